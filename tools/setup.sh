#!/bin/sh
# Make the virtual environment $1 and install rig into it. Python's venv module and headers come
# from Debian's packages where they are missing.
set -eu
venv=$1
python=${PYTHON:-python3}

complete() {
    "$python" - <<'PROBE'
import os, sys, sysconfig
if sys.version_info < (3, 11):
    sys.exit(f"rig needs Python 3.11 or newer, this is {sys.version.split()[0]}")
import ensurepip, venv  # noqa: F401
header = os.path.join(sysconfig.get_paths()["include"], "Python.h")
sys.exit(0 if os.path.exists(header) else f"{header} is missing")
PROBE
}

if ! complete 2>/dev/null; then
    echo "Python's venv module or headers are missing; installing python3-venv and python3-dev"
    sudo=
    if [ "$(id -u)" -ne 0 ]; then sudo=sudo; fi
    $sudo apt-get update -qq && $sudo apt-get install -y -qq python3-venv python3-dev || {
        echo "Please install them by hand: apt-get install python3-venv python3-dev" >&2
        exit 1
    }
    complete
fi

[ -x "$venv/bin/python" ] || "$python" -m venv "$venv"
"$venv/bin/python" -m pip install --quiet --disable-pip-version-check -r requirements.lock
"$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
