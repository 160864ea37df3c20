#!/usr/bin/env bash
# Goes back to the release before this one, or to a named one, and restarts the rigs that run.
#
#   deploy/rollback.sh [--root DIR] [RELEASE]
#
# Presets, last good sets and /etc/drumstick stay as they are. Run twice, it is where it began.
set -euo pipefail
# shellcheck source=deploy/staged.sh
. "$(dirname "$0")/staged.sh"
staged_options "$@"
[[ ${#rest[@]} -le 1 ]] || wrong "give one release: $(ls "$opt/releases")"

now="$(release_at current || true)"
[[ -n "$now" ]] || lacking "$opt/current: nothing is installed here"
was="$(installed_now)"
to="${rest[0]:-$(release_at previous || true)}"
if [[ ${#rest[@]} -eq 0 && "$to" == "$now" ]]; then # the power went between the two steps below
    to=""
    for other in "$opt"/releases/*/lock; do
        other="$(basename "${other%/lock}")"
        [[ "$other" == "$now" ]] || to="$other"
    done
fi
[[ -n "$to" ]] || lacking "$opt holds no release before $now"
[[ "$to" =~ ^[A-Za-z0-9._+-]+$ && -f "$opt/releases/$to/lock" ]] ||
    wrong "$to is no whole release; there are: $(cd "$opt/releases" && echo *)"
if [[ "$to" == "$now" ]]; then
    say "$now is the current release already"
    exit 0
fi
look "$opt/releases/$to"
point previous "$now"
point current "$to"
put_units "$opt/releases/$to"
say "current: $to, before: $now"
restart_what_runs "$was"
