#!/usr/bin/env bash
# Installs the missing system packages of the named sections (play, test) of system-packages.txt, where it may:
# as root or with sudo that asks no password, on Debian and its kin. Otherwise it prints the one line to type and
# succeeds all the same: what needs the package goes without (sound into a WAV file, a test skips and says why).
set -euo pipefail

export PYTHON="${PYTHON:-python3}"
list="$(dirname "$0")/system-packages.txt"

missing() { # section ...
    local section="" line package probe
    while IFS= read -r line; do
        case "$line" in
            "# section: "*) section="${line#\# section: }" ;;
            "#"* | "") ;;
            *)
                [[ " $* " == *" $section "* ]] || continue
                package="${line%%[[:space:]]*}"
                probe="${line#*have:}"
                bash -c "$probe" >/dev/null 2>&1 </dev/null || printf '%s\n' "$package"
                ;;
        esac
    done <"$list"
}

installed_by_debian() { # package
    [[ "$(dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null)" == installed ]]
}

read -r -d "" -a wanted < <(missing "$@") || true # not mapfile: macOS has bash 3.2
[[ ${#wanted[@]} -eq 0 ]] && exit 0

if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
    printf 'This machine lacks what Debian calls %s: please install it your way.\n' "${wanted[*]}" >&2
    exit 0
fi

packages=()
for package in "${wanted[@]}"; do
    if installed_by_debian "$package"; then
        printf '%s is installed, but %s does not find it: going on without.\n' "$package" "$PYTHON" >&2
    else
        packages+=("$package")
    fi
done
[[ ${#packages[@]} -eq 0 ]] && exit 0

as_root=()
if [[ "$(id -u)" -ne 0 ]]; then
    if ! sudo -n true >/dev/null 2>&1; then
        printf 'Missing: %s. To have it, type:\n  sudo apt-get install --no-install-recommends %s\n' \
            "${packages[*]}" "${packages[*]}" >&2
        exit 0
    fi
    as_root=(sudo -n)
fi

# Questions (jackd2 asks about real-time priority) take their defaults; another apt is waited for.
apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=120)
printf 'Installing system packages: %s\n' "${packages[*]}"
if ! { "${apt[@]}" update && "${apt[@]}" install -y --no-install-recommends "${packages[@]}"; } </dev/null >/dev/null; then
    printf 'These could not be installed: %s. To try by hand:\n  sudo apt-get install --no-install-recommends %s\n' \
        "${packages[*]}" "${packages[*]}" >&2
fi
