#!/usr/bin/env bash
# Takes away what install.sh put on this machine. Presets, last good sets and /etc/drumstick stay, but for --purge.
#
#   deploy/uninstall.sh [--purge] [--root DIR]
set -euo pipefail
# shellcheck source=deploy/staged.sh
. "$(dirname "$0")/staged.sh"
staged_options "$@"
purge=no
for word in "${rest[@]}"; do
    [[ "$word" == --purge ]] || wrong "$word: there is --purge and --root; see $0 --help"
    purge=yes
done

if is_live; then
    mapfile -t running < <(systemctl list-units --all --plain --no-legend 'drumstick*@*' | cut -d ' ' -f 1)
    [[ ${#running[@]} -eq 0 ]] || systemctl stop "${running[@]}"
fi
# Links of `systemctl enable`, whatever their rig is called.
find "$root/etc/systemd/system" \( -name 'drumstick-*@*' -o -name 'drumstick@*' \) -type l -delete 2>/dev/null || true
find "$root/etc/systemd/system" -name 'drumstick@*.target.wants' -type d -empty -delete 2>/dev/null || true
rm -f "$units"/drumstick*@.* "$root/usr/local/lib/sysusers.d/drumstick.conf" "$root/etc/udev/rules.d/70-phantom.rules" \
    "$root/usr/local/bin/drumstick" "$root/usr/local/bin/drumstick-at"
rm -rf "$opt" "$cache" "$run"
is_live && systemctl daemon-reload
say "Removed: the releases, the units, the kernel cache"
if [[ "$purge" == yes ]]; then
    rm -rf "$state" "$etc"
    if [[ -z "$root" ]] && id drumstick >/dev/null 2>&1; then
        userdel drumstick
    fi
    say "Removed too: presets and last good sets ($state), options and keys ($etc), the user drumstick"
else
    say "Kept: presets and last good sets in $state, options and keys in $etc (--purge removes them)"
fi
