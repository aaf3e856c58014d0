"""The root of every error that `rig` raises on purpose.

Each part of the package derives one family from `RigError`. The command line prints them as one
paragraph and exits with the family's code; anything else is a bug and says so.
"""


class RigError(Exception):
    """Something the user can act on: what was wrong, where, what was expected, what to do.

    `exit_code` is the exit status of the command line when the error reaches it.
    """

    exit_code = 1
