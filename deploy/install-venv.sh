#!/usr/bin/env bash
# Makes .venv from a lock file, and the project and its laboratory in it, editable: install-venv.sh requirements.lock
# With a folder the environment goes there instead, and the project alone into it as a copy, for a machine on which nobody
# edits: install-venv.sh requirements.lock /opt/somewhere/venv
# Only what the lock's hashes name is installed, and only wheels; pip's own configuration says from where.
set -euo pipefail
cd "$(dirname "$0")/.."

lock="$1"
venv="${2:-.venv}"
project=(--editable .)
[[ -f lab/pyproject.toml ]] && project+=(--editable lab) # an image may be made without the laboratory
[[ $# -gt 1 ]] && project=(.)
python="${PYTHON:-python3}"

"$python" - <<'PYTHON' || exit 1
import sys

if not (3, 11) <= sys.version_info[:2] <= (3, 14):
    sys.exit(f"Python 3.11 to 3.14 is needed, this is {sys.version.split()[0]}: say which with make PYTHON=python3.12")
PYTHON

if ! "$venv/bin/python" -c "import pip" 2>/dev/null; then
    if ! "$python" -c "import ensurepip, venv" 2>/dev/null; then
        echo "$python cannot make virtual environments. On Debian type: sudo apt-get install python3-venv" >&2
        exit 1
    fi
    "$python" -m venv --clear "$venv"
fi

pip=("$venv/bin/python" -m pip --disable-pip-version-check --quiet --quiet install --no-compile --no-deps)
"${pip[@]}" --only-binary :all: --require-hashes -r "$lock"
"${pip[@]}" --no-build-isolation "${project[@]}"

# Byte code for all of it, now: whoever starts it later may not be allowed to write any (a folder that its users only
# read, PYTHONDONTWRITEBYTECODE), and would then compile eight hundred modules at every start, which takes as long as
# all the rest of starting. A file of some package that is no Python for this version says so, and stops nothing.
sources=("$venv"/lib/python3.*/site-packages)
if [[ $# -le 1 ]]; then
    sources+=(services shared)
    [[ -d lab ]] && sources+=(lab)
fi
env -u PYTHONDONTWRITEBYTECODE "$venv/bin/python" -m compileall -q -j 0 "${sources[@]}" \
    || echo "These have no byte code; whoever imports them compiles them at each start." >&2
