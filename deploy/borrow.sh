#!/usr/bin/env bash
# Takes an environment's packages over into a new one, without a network: borrow.sh FROM TO PLACE [--linked]
#
# TO is made, for somebody who moves it to PLACE then: its programs name that folder. --linked is for FROM of the same
# owner, who writes nothing into it any more: hard links, which take no room. Without it TO is a copy that belongs to
# whoever runs this and that nobody else may write, whatever FROM is like: services will run what it holds.
# $PYTHON is the Python it is for. Status 1: FROM is no environment of that; 3: it cannot be copied.
set -euo pipefail

from="$1" to="$2" place="$3" how="${4:-}"
base="$PYTHON"
its="$("$base" -c 'import sys; print("python%d.%d" % sys.version_info[:2])')"
[[ -f "$from/pyvenv.cfg" && -d "$from/lib/$its/site-packages" ]] || exit 1

umask 022
copied() {
    rm -rf "$to" # what a try to link left
    cp -dR --preserve=timestamps "$from" "$to" && chmod -R u=rwX,go=rX "$to"
}
# Links end at a file system's border.
{ [[ "$how" == --linked ]] && cp -al "$from" "$to" 2>/dev/null; } || copied || exit 3

for name in python python3 "$its"; do ln -sfn "$base" "$to/bin/$name"; done
# sed writes a new file; the other environment keeps its own.
sed -i "s|^home = .*|home = $(dirname "$base")|" "$to/pyvenv.cfg" || exit 3
{ grep -rlIF "$from" "$to/bin" "$to/pyvenv.cfg" || true; } | xargs -r sed -i "s|$from|$place|g"
