#!/usr/bin/env bash
# Boots a throw-away copy of this machine's system in a container, installs this checkout there, and looks at the
# units as systemd runs them: ready, killed and back, hung and back, another scene, update and rollback, removal.
#
#   sudo deploy/try-units.sh [--packages-from VENV]
#
# Needs root and systemd-nspawn (Debian: systemd-container). What is written goes to memory and is forgotten.
# Some minutes: the kernels are compiled afresh.
set -euo pipefail
cd "$(dirname "$0")/.."
here="$PWD"
[[ "$(id -u)" -eq 0 ]] || { echo "as root: sudo $0" >&2; exit 2; }
command -v systemd-nspawn >/dev/null || { echo "systemd-nspawn is missing: apt-get install systemd-container" >&2; exit 3; }

place="$(mktemp -d)"
leader=""
box=""
leave() {
    [[ -z "$leader" ]] || kill -RTMIN+4 "$leader" 2>/dev/null || true # systemd's own signal: power off
    [[ -z "$box" ]] || wait "$box" 2>/dev/null || true
    umount -l "$place/root" "$place" 2>/dev/null || true
    rmdir "$place" 2>/dev/null || true
}
trap leave EXIT

mount -t tmpfs tmpfs "$place"
mkdir "$place"/{up,work,root}
mount -t overlay overlay -o "lowerdir=/,upperdir=$place/up,workdir=$place/work" "$place/root"
rm -f "$place/root/etc/machine-id"
# It would empty /tmp, where the checkout may lie.
ln -s /dev/null "$place/root/etc/systemd/system/systemd-tmpfiles-setup.service"
systemd-machine-id-setup --root="$place/root" >/dev/null 2>&1 || true
env SYSTEMD_NSPAWN_TMPFS_TMP=0 systemd-nspawn --quiet --directory="$place/root" --register=no --keep-unit --private-network \
    --boot --machine="drumstick-$$" --console=pipe -- systemd.unit=multi-user.target >"$place/console" 2>&1 </dev/null &
box=$!
for _ in $(seq 100); do
    leader="$(cat "/proc/$box/task/$box/children" 2>/dev/null || true)"
    leader="${leader%% *}"
    [[ -n "$leader" && -d "/proc/$leader/root/run/systemd/system" ]] && break
    sleep 0.2
done
[[ -n "$leader" ]] || { cat "$place/console"; echo "the container did not start" >&2; exit 1; }

inside() { nsenter -t "$leader" -a -- env PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin "$@"; }
property() { inside systemctl show --value --property "$2" "$1"; }
said() { # seconds, what, command ...: until the command succeeds
    local within="$1" what="$2" begun=$SECONDS
    shift 2
    until "$@"; do
        if ((SECONDS - begun > within)); then
            printf 'NOT: %s\n' "$what" >&2
            inside systemctl --no-pager list-units --all 'drumstick*' >&2 || true
            inside journalctl --no-pager -n 60 -u 'drumstick*' >&2 || true
            exit 1
        fi
        sleep 0.2
    done
    printf '%3d s  %s\n' $((SECONDS - begun)) "$what"
}
is_active() { local unit; for unit in "$@"; do [[ "$(property "$unit" ActiveState)" == active ]] || return 1; done; }
is_other() { # unit, pid before; for a moment after an end the unit is active still, and its pid 0
    local now
    now="$(property "$1" MainPID)"
    [[ "$now" != 0 && "$now" != "$2" ]] && is_active "$1"
}
tells() { property "$1" StatusText | grep -q "$2"; }
ticks_of() { property "$servo" StatusText | sed -n 's/.*, \([0-9]*\) ticks.*/\1/p'; }

servo=drumstick-servo@main.service gateway=drumstick-gateway@main.service
sound=drumstick-sound@main.service panel=drumstick-panel@main.service
inside systemctl is-system-running --wait >/dev/null 2>&1 || true
mkdir -p "$place/root/etc/drumstick"
cat >"$place/root/etc/drumstick/main.env" <<'OPTIONS'
SOUND_OPTIONS=--audio null
OPTIONS
inside "$here/deploy/install.sh" "$@" --role haptic --role sound --role panel
said 300 "every process says that it is ready" is_active "$servo" "$gateway" "$sound" "$panel"
said 20 "the force loop tells of its strikes" tells "$servo" "playing; [0-9]* strikes"
inside systemctl show "$servo" "$sound" --property StatusText
printf '       the force loop got: %s\n' "$(inside sh -c 'cat /run/drumstick/main/*/servo.json')"
printf '       drumstick-servo@main: exposure %s\n' "$(inside systemd-analyze --no-pager security "$servo" 2>/dev/null | tail -n 1)"

for unit in "$servo" "$gateway" "$sound"; do
    pid="$(property "$unit" MainPID)" begun="$(date +%s%N)"
    inside kill -9 "$pid"
    said 60 "${unit%%@*}, killed, is back" is_other "$unit" "$pid"
    printf '       %s was ready again after %d ms\n' "${unit%%@*}" $((($(date +%s%N) - begun) / 1000000))
done
pid="$(property "$servo" MainPID)"
inside kill -STOP "$pid"
said 60 "a force loop that hangs is ended by the watchdog, and back" is_other "$servo" "$pid"
inside journalctl --no-pager -q -u "$servo" | grep -i "watchdog" | tail -n 2

inside drumstick-at main params get dv_pls >/dev/null
said 10 "a preset is kept" inside drumstick-at main preset save kept
pid="$(property "$gateway" MainPID)" restarts="$(property "$servo" NRestarts)"
inside /opt/drumstick/current/venv/bin/python - <<'PYTHON'
"""Ten changes of scene, then ten in which a panic comes: the gap in the strikes, how soon the panic is told."""
import random, statistics, subprocess, time
import msgspec, zenoh
from protocol.keys import DEFAULT_ROUTER, Keys
from protocol.messages import State, Strike, decode
from protocol.session import client_config

keys, strikes, states = Keys("main"), [], []
with zenoh.open(client_config(DEFAULT_ROUTER, None)) as session:
    def ask(key, *payload):
        (reply,) = session.get(key, payload=msgspec.msgpack.encode([1, *payload]), timeout=5.0)
        assert reply.ok is not None, reply.err.payload.to_bytes()

    def until(what, is_so, within_s=120.0):
        end = time.monotonic() + within_s
        while not is_so():
            assert time.monotonic() < end, f"not after {within_s} s: {what}; {states[-1:]}"
            time.sleep(0.005)

    heard = [
        session.declare_subscriber(keys.strike, lambda sample: strikes.append(decode(sample.payload.to_bytes(), Strike))),
        session.declare_subscriber(keys.state, lambda sample: states.append(decode(sample.payload.to_bytes(), State))),
    ]
    until("strikes and states", lambda: strikes and states)
    gaps_s, told_s = [], []
    for change in range(10):
        boot = strikes[-1].boot
        ask(keys.scene_load, ("tom", "roll")[change % 2])
        until("strikes of the other scene", lambda: strikes[-1].boot != boot)
        before, after = ([each.t_ns for each in strikes if (each.boot == boot) is old] for old in (True, False))
        gaps_s.append((after[0] - before[-1]) * 1e-9)
        strikes[:] = strikes[-1:]
        time.sleep(1.0)
    for change in range(10):
        ask(keys.scene_load, ("tom", "roll")[change % 2])
        time.sleep(random.uniform(0.0, 4.0))
        pressed_s = time.monotonic()
        ask(keys.panic)
        until("a panic", lambda: states[-1].status == "panic", 10.0)
        told_s.append(time.monotonic() - pressed_s)
        seen = len(states)
        time.sleep(1.0)
        assert {each.status for each in states[seen:]} == {"panic"}, [(each.boot, each.status) for each in states[seen:]]
        subprocess.run(["drumstick-at", "main", "arm"], check=True, stdout=subprocess.DEVNULL)
        until("force again", lambda: states[-1].status == "playing")
    print(f"       another scene: {statistics.median(gaps_s):.2f} s from strike to strike, worst of 10 {max(gaps_s):.2f} s")
    print(f"       a panic meanwhile: told after {max(told_s) * 1e3:.0f} ms at most")
    assert max(told_s) < 1.0, told_s
PYTHON
[[ "$(property "$gateway" MainPID)" == "$pid" ]] || { echo "NOT: the gateway plays on" >&2; exit 1; }
sleep 4 # longer than the watchdog waits
[[ "$(property "$servo" NRestarts)" == "$restarts" ]] || { echo "NOT: no force loop was ended by its watchdog" >&2; exit 1; }
inside kill -9 "$(property "$servo" MainPID)"
has_restarted() { [[ "$(property "$servo" NRestarts)" -gt "$restarts" ]] && is_active "$servo"; }
said 60 "a force loop that came with another scene, killed, is back" has_restarted
ask_for() { # scene, as a technician does
    inside /opt/drumstick/current/venv/bin/python - "$1" <<'PYTHON'
import sys
import msgspec, zenoh
from protocol.keys import DEFAULT_ROUTER, Keys
from protocol.session import client_config
with zenoh.open(client_config(DEFAULT_ROUTER, None)) as session:
    (reply,) = session.get(Keys("main").scene_load, payload=msgspec.msgpack.encode([1, sys.argv[1]]), timeout=5.0)
    assert reply.ok is not None, reply.err.payload.to_bytes()
PYTHON
}
is_scene() { inside sh -c "grep -q '^name = \"$1\"' /run/drumstick/main/*/scene.toml"; }
inside systemctl restart "$servo" # ends the one that was killed and is back, which is systemd's own
pid="$(property "$servo" MainPID)"
is_scene roll && other=tom || other=roll
begun="$(inside date +%s)"
ask_for "$other"
said 60 "another scene" is_other "$servo" "$pid"
said 60 "in its place" is_scene "$other"
inside systemctl restart "$servo"
for words in "not our child" "signal SIGKILL" "Missing argument"; do
    ! inside journalctl --no-pager -q -u "$servo" --since "@$begun" | grep "$words" ||
        { echo "NOT: systemd waits for the end of a force loop that came with another scene" >&2; exit 1; }
done
said 60 "it ends in good order, and starts" is_active "$servo"

# An arm is opened only when its turn has come: a scene that is too hard for it ends the force loop then.
site="$(inside sh -c 'echo /opt/drumstick/current/venv/lib/python3.*/site-packages')"
inside tee "$site/soft_arm.py" >/dev/null <<'PYTHON'
import drumstick as ds
class Still(ds.Record):
    force_N: float
def read(state, reading, span_s):
    reading.z_m, reading.fresh = 0.02, 1
def write(state, force_N):
    state.force_N = force_N
ARM = ds.Device(
    ds.Specification("soft arm", (0.4, 0.2, 0.25), 3e-5, 8.5, 1.4, 3500.0, 20.0, range(500, 2001)), Still, read, write
)
PYTHON
inside mkdir "$site/soft_arm-1.dist-info"
printf 'Metadata-Version: 2.1\nName: soft-arm\nVersion: 1\n' | inside tee "$site/soft_arm-1.dist-info/METADATA" >/dev/null
printf '[drumstick.devices]\nsoft_arm = soft_arm:ARM\n' | inside tee "$site/soft_arm-1.dist-info/entry_points.txt" >/dev/null
inside sh -c 'echo "SERVO_OPTIONS=--scene phantom --device soft_arm" >>/etc/drumstick/main.env'
inside systemctl restart "$servo"
said 120 "an arm plays" tells "$servo" "strikes"
pid="$(property "$servo" MainPID)"
ask_for roll
said 240 "a scene that is too hard for it gives way to the one before" is_other "$servo" "$pid"
said 60 "which lies there" is_scene phantom
inside journalctl --no-pager -q -n 40 -u "$servo" -u drumstick-scene@main.service | grep "roll\|envelope\|previous" || true
inside sed -i /SERVO_OPTIONS/d /etc/drumstick/main.env
inside systemctl restart "$servo"
said 120 "the simulated stick again" is_active "$servo"

pid="$(property "$servo" MainPID)"
inside "$here/deploy/install.sh" --role panel
[[ "$(property "$servo" MainPID)" == "$pid" ]] || { echo "NOT: an install that changes nothing lets the force play on" >&2; exit 1; }

before="$(inside readlink /opt/drumstick/current)"
mkdir -p "$place/root/root/next"
cp -r services shared deploy docs pyproject.toml requirements.lock README.md LICENSE "$place/root/root/next/"
sed -i 's/^version = .*/version = "99.0.0"/' "$place/root/root/next/pyproject.toml"
inside /root/next/deploy/install.sh
said 240 "the update plays" is_active "$servo" "$gateway" "$sound" "$panel"
inside /opt/drumstick/current/deploy/rollback.sh
[[ "$(inside readlink /opt/drumstick/current)" == "$before" ]]
said 240 "the release before plays again" is_active "$servo" "$gateway" "$sound" "$panel"
has_preset() { inside drumstick-at main preset list 2>/dev/null | grep -q kept; }
said 20 "the preset is still there" has_preset
inside /opt/drumstick/current/deploy/uninstall.sh
inside test ! -e /opt/drumstick
inside test -d /var/lib/drumstick/drumstick/main
echo "all as it should be"
