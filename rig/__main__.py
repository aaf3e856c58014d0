"""`python -m rig` is the command line."""

from rig.cli.main import main

main()
