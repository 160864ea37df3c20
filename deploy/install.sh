#!/usr/bin/env bash
# Installs this checkout as a release for systemd, beside the release before it, and restarts the rigs that run.
#
#   deploy/install.sh [--rig NAME] [--role haptic|door|sound|panel]... [--packages-from VENV] [--root DIR]
#
# --rig NAME    the rig that the roles are for (main)
# --role ROLE   what this machine does, and begins to do now; may be repeated. Without it nothing new is switched on.
#               haptic is with door where the rig file has zenoh.public
# --root DIR    into a folder, to look at it: nothing of this machine is touched
# --packages-from VENV   copy Python packages from there first, e.g. from .venv after `make install`: no network for
#               those; what it holds beside the lock's packages comes too, and the services run it
#
# It asks nothing, needs the network only for Python packages that are new, and may be run as often as you like.
# Going back: deploy/rollback.sh. docs/install.md has the rest.
set -euo pipefail
cd "$(dirname "$0")/.."
# shellcheck source=deploy/staged.sh
. deploy/staged.sh
staged_options "$@"
set -- "${rest[@]}"

rig=main roles=() packages=""
while [[ $# -gt 0 ]]; do
    [[ $# -gt 1 ]] || wrong "$1: needs a value; see $0 --help"
    case "$1" in
        --rig) rig="$2" ;;
        --role) roles+=("$2") ;;
        --packages-from) packages="$(realpath "$2")" ;;
        *) wrong "$1: there is --rig, --role, --packages-from and --root; see $0 --help" ;;
    esac
    shift 2
done
[[ "$rig" =~ ^[A-Za-z0-9_-][A-Za-z0-9_.-]{0,39}$ ]] || wrong "--rig $rig: letters, digits, _, - and ., the first no ., at most 40"

services_of() { # role
    case "$1" in
        haptic) printf 'drumstick-servo@%s.service drumstick-gateway@%s.service drumstick-scene@%s.path\n' "$rig" "$rig" "$rig" ;;
        door | sound | panel) printf 'drumstick-%s@%s.service\n' "$1" "$rig" ;;
        *) wrong "--role $1: there is haptic, door, sound and panel" ;;
    esac
}
for role in "${roles[@]}"; do services_of "$role" >/dev/null; done

version="$(sed -n 's/^version = "\(.*\)"$/\1/p' pyproject.toml | head -n 1)"
content="$(find services shared deploy pyproject.toml requirements.lock README.md LICENSE -type f -not -path '*/__pycache__/*' \
    -print0 | LC_ALL=C sort -z | xargs -0 sha256sum | sha256sum | cut -c 1-10)"
release="$version-$content"
made="$opt/releases/$release"
before="$(release_at current || true)"
was="$(installed_now)"
lock="$(sha256sum requirements.lock | cut -c 1-64)"

# The services' user cannot reach a Python in somebody's home (pyenv, uv), and ProtectHome would hide it anyway.
python="${PYTHON:-python3}"
in_a_home() { [[ "$1" == /root/* || "$1" == /home/* || "$1" == /run/user/* ]]; }
real() { "$1" -c 'import os, sys; print(os.path.realpath(sys.executable))'; }
base="$(real "$python")"
if [[ -z "$root" ]] && in_a_home "$base"; then
    python=/usr/bin/python3
    [[ -x "$python" ]] || lacking "$base lies in a home, which the services may not see: install the system's python3"
    base="$(real "$python")"
fi
export PYTHON="$python"

borrow() { # environment [--linked]
    local status=0
    PYTHON="$base" deploy/borrow.sh "$1" "$made.new/venv" "$made/venv" "${@:2}" || status=$?
    [[ $status -lt 2 ]] || lacking "$1: its packages cannot be copied to $made.new"
    return $status
}

build() {
    rm -rf "$made.new" "$made"
    install -d "$made.new"
    if [[ -n "$packages" ]]; then
        borrow "$packages" || wrong "--packages-from $packages: no environment of the same Python as $base"
        say "Python packages are taken from $packages as far as they fit"
    elif [[ -n "$before" && -O "$opt/releases/$before/venv" && "$(cat "$opt/releases/$before/lock")" == "$lock" ]] && borrow "$opt/releases/$before/venv" --linked; then
        say "The packages are those of $before: taken from there"
    else
        say "Installing Python packages: some 600 MB on the disk, a minute or more"
    fi
    # Only now to its place: its programs name the folder in which they are. A release without `lock` is not whole.
    mv -T "$made.new" "$made"
    deploy/install-venv.sh requirements.lock "$made/venv"
    cp -r deploy "$made/deploy"
    install -d "$made/docs"
    cp docs/*.md "$made/docs"
    find "$made/deploy" -name __pycache__ -prune -exec rm -rf {} +
    look "$made"
    printf '%s\n' "$lock" >"$made/lock"
}

umask 022
deploy_packages() { [[ -n "$root" ]] || deploy/install-system.sh play; }
deploy_packages
[[ -n "$root" ]] || systemd-sysusers "$PWD/deploy/systemd/drumstick.sysusers"
if [[ -f "$made/lock" ]]; then
    say "Release $release is installed already"
else
    install -d "$opt/releases"
    build
    say "Installed release $release in $made"
fi
if [[ "$before" != "$release" ]]; then
    [[ -n "$before" ]] && point previous "$before"
    point current "$release"
    say "current: $release${before:+, before: $before (deploy/rollback.sh goes back to it)}"
fi

put_units "$made"
if [[ -z "$root" ]]; then
    owner=(-o root -g drumstick)
else
    owner=()
fi
install -d -m 0750 "${owner[@]}" "$etc" "$etc/$rig"
[[ -e "$etc/$rig.env" ]] || install -m 0640 "${owner[@]}" deploy/systemd/example.env "$etc/$rig.env"
[[ -e "$etc/$rig/rig.toml" ]] || install -m 0640 "${owner[@]}" deploy/systemd/example-rig.toml "$etc/$rig/rig.toml"

for old in "$opt"/releases/*; do
    name="$(basename "$old")"
    [[ "$name" == "$release" || "$name" == "$(release_at current)" || "$name" == "$(release_at previous || true)" ]] && continue
    rm -rf "$old"
    say "Removed the older release $name"
done

restart_what_runs "$was"
if [[ ${#roles[@]} -eq 0 ]]; then
    say "Nothing new was switched on. To play here: sudo deploy/install.sh --role haptic --role sound --role panel"
    exit 0
fi
if [[ " ${roles[*]} " == *" haptic "* && " ${roles[*]} " != *" door "* ]]; then
    if grep -Eq '^[[:space:]]*public[[:space:]]*=' "$etc/$rig/rig.toml"; then
        roles+=(door)
    else
        say "Nobody comes in from other machines: $etc/$rig/rig.toml has no zenoh.public (docs/install.md, Several machines)"
    fi
fi
wanted=("drumstick@$rig.target")
for role in "${roles[@]}"; do
    read -ra more < <(services_of "$role")
    wanted+=("${more[@]}")
done
if is_live; then
    systemctl enable --quiet "${wanted[@]}"
    systemctl start --no-block "${wanted[@]}"
    say "Switched on, now and at every start: ${wanted[*]}"
    say "How it goes: systemctl status -n 0 'drumstick-*@$rig', journalctl -fu 'drumstick-*@$rig'"
else
    systemctl --root="${root:-/}" enable --quiet "${wanted[@]}"
    say "Switched on for the next start: ${wanted[*]}"
fi
