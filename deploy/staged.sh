#!/usr/bin/env bash
# What install.sh, rollback.sh and uninstall.sh share; they read it, nobody runs it. After `staged_options "$@"`:
# $root (empty: this machine), $opt, $units, $state, $cache, $run and $etc below it; $rest holds the other arguments.

staged_options() { # arguments
    root="" rest=()
    while [[ $# -gt 0 ]]; do
        case "$1" in
            --root)
                [[ $# -gt 1 && -n "$2" ]] || wrong "--root: name a folder"
                root="$(realpath -m "$2")"
                [[ "$root" == / ]] && root=""
                shift 2
                ;;
            -h | --help)
                sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"
                exit 0
                ;;
            *)
                rest+=("$1")
                shift
                ;;
        esac
    done
    opt="$root/opt/drumstick" units="$root/usr/local/lib/systemd/system" etc="$root/etc/drumstick"
    state="$root/var/lib/drumstick" cache="$root/var/cache/drumstick" run="$root/run/drumstick"
    export opt units etc state cache run
    if [[ -z "$root" && "$(id -u)" -ne 0 ]]; then
        wrong "only root may do this to this machine: sudo $0, or try it in a folder with --root DIR"
    fi
}

say() { printf '%s\n' "$*"; }

wrong() {
    printf '%s\n' "$*" >&2
    exit 2
}

lacking() {
    printf '%s\n' "$*" >&2
    exit 3
}

is_live() { # whether there is a systemd to talk to
    [[ -z "$root" && -d /run/systemd/system ]]
}

# Release that `current` or `previous` names; nothing where there is none.
release_at() { # current|previous
    [[ -L "$opt/$1" ]] && basename "$(readlink "$opt/$1")"
}

point() { # current|previous release: in one step, so that a power cut leaves the one or the other, whole on the disk
    ln -sfn "releases/$2" "$opt/.$1.new"
    sync -f "$opt"
    mv -T "$opt/.$1.new" "$opt/$1"
    sync -f "$opt"
}

# What runs here depends on: another text, and it must be started again.
installed_now() {
    release_at current || true
    { cat "$units"/drumstick*@.* 2>/dev/null || true; } | sha256sum
}

look() { # folder of a release: what the services will do, before anybody depends on it
    local as=()
    [[ -n "$root" ]] || as=(runuser -u drumstick --)
    "${as[@]}" env -C / HOME=/ "$1/venv/bin/drumstick" scene check roll >/dev/null ||
        lacking "$1 does not play as it should; nothing was switched over to it"
}

put_units() { # folder of a release: its units and rules take the place of whatever was there
    local file
    install -d "$units" "$root/usr/local/lib/sysusers.d" "$root/etc/udev/rules.d" "$root/usr/local/bin"
    for file in "$units"/drumstick*@.*; do
        [[ -e "$1/deploy/systemd/$(basename "$file")" ]] || rm -f "$file"
    done
    install -m 0644 "$1/deploy/systemd/drumstick.sysusers" "$root/usr/local/lib/sysusers.d/drumstick.conf"
    [[ -n "$root" ]] || systemd-sysusers /usr/local/lib/sysusers.d/drumstick.conf
    install -m 0644 "$1"/deploy/systemd/drumstick*@.* "$units"
    [[ -n "$root" ]] || sed -i "s/@UID@/$(id -u drumstick)/" "$units"/drumstick*@.path
    install -m 0644 "$1/deploy/udev/70-phantom.rules" "$root/etc/udev/rules.d/70-phantom.rules"
    install -m 0755 "$1/deploy/drumstick-at" "$root/usr/local/bin/drumstick-at"
    ln -sfn "/opt/drumstick/current/venv/bin/drumstick" "$root/usr/local/bin/drumstick"
    is_live || return 0
    systemctl daemon-reload
    udevadm control --reload 2>/dev/null || say "udev does not run here: the rules of the PHANTOM count from its next start on"
}

restart_what_runs() { # what installed_now said before
    is_live || return 0
    [[ "$(installed_now)" != "$1" ]] || return 0
    local targets
    mapfile -t targets < <(systemctl list-units --plain --no-legend --state=active 'drumstick@*.target' | cut -d ' ' -f 1)
    [[ ${#targets[@]} -eq 0 ]] && return 0
    say "Restarting ${targets[*]}"
    systemctl restart "${targets[@]}"
}
