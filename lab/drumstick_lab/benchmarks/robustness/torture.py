"""A playing rig is tortured, and its promises are watched: drumstick lab torture --minutes N [--seed S].

Services are killed and stopped; OSC and Zenoh are flooded; the output is not read, the disk is full, the processors are
busy, the wall clock jumps, the link to a second sound server is cut. One or two at a time, drawn from the seed, while
values are set and panics are sent. What is promised, and checked in each round:

- the rig never ends, and all its parts are back, a latched fault being armed by hand;
- a value that was answered ok is there afterwards, whoever was killed (floods apart: some of them are good sets);
- a panic that is sent once acts while the gateway lives, a repeated one within 4 s of a kill, and then nothing strikes.

Stores lab/results/torture.json and goes on from it: minutes add up. A disk that is full needs root (a small
file system of its own), jumps of the clock need a C compiler; the result says what was not tried.
"""

import argparse
import contextlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rig_process import running, wait_for

from drumstick_lab.benchmarks.robustness.torture_harm import GATEWAY, SERVO, Stage, all_harms
from drumstick_lab.benchmarks.robustness.torture_link import Link
from drumstick_lab.benchmarks.robustness.torture_watch import Broken, Watch
from drumstick_lab.measuring import stored

HERE = Path(__file__).parent

PANIC_WITHIN_S, PANIC_AFTER_A_KILL_S = 1.0, 4.0
A_RIG_S = 300.0  # so long plays one; then another is started


def empty() -> dict[str, Any]:
    """A result before the first minute."""
    return {
        "minutes": 0.0,
        "next_seed": 1,
        "rounds": 0,
        "strikes": {"heard": 0, "lost": 0},
        "values": {"accepted": 0, "refused": 0, "lost": 0},
        "panics": {"sent": 0, "longest_s": 0.0, "after_a_kill": 0, "longest_after_a_kill_s": 0.0},
        "harms": {},
        "broken": [],
    }


@contextlib.contextmanager
def small_disk() -> Iterator[tuple[Path, bool]]:
    """A folder for the rig's state, and whether it is a file system of 1 MB of its own."""
    with tempfile.TemporaryDirectory(prefix="drumstick-torture-") as folder:
        command = ["mount", "-t", "tmpfs", "-o", "size=1m", "torture", folder]
        is_small = (
            os.geteuid() == 0 and subprocess.run(command, check=False, capture_output=True).returncode == 0
        )
        try:
            yield Path(folder), is_small
        finally:
            if is_small:
                subprocess.run(["umount", folder], check=True)


@contextlib.contextmanager
def jumping_clock(folder: Path) -> Iterator[Path | None]:
    """The file from which every process started inside reads its clock's offset; None without a C compiler."""
    compiler, library = shutil.which("cc"), folder / "torture_clock.so"
    if compiler is None:
        yield None
        return
    subprocess.run(
        [compiler, "-O2", "-shared", "-fPIC", "-o", library, HERE / "torture_clock.c", "-ldl"], check=True
    )
    offset = folder / "offset"
    offset.write_bytes(bytes(8))
    added = {"LD_PRELOAD": str(library), "DRUMSTICK_CLOCK": str(offset)}
    os.environ.update(added)
    try:
        yield offset
    finally:
        for name in added:
            del os.environ[name]


def rounds(stage: Stage, watch: Watch, harms: dict[str, Any], result: dict[str, Any], until_s: float) -> None:
    """Torture until then. Whatever does not hold is noted, and it goes on."""
    watch.back(sounds=2)
    watch.accepted = watch.values()
    while time.monotonic() < until_s:
        names = stage.chance.sample(sorted(harms), stage.chance.choice((1, 1, 2)))
        names.sort(key=lambda name: name != "readers stopped")  # they need a rig that is well, to begin with
        if "output unread" in names and any(name.startswith(("kill", "stop")) for name in names):
            continue  # a supervisor that stands restarts nobody
        try:
            one_round(stage, watch, [(name, harms[name]) for name in names], result)
        except (Broken, AssertionError) as broken:
            said = {"names": names, "what": str(broken)[:500], "log": stage.rig.lines[-5:]}
            result["broken"].append({"seed": result["next_seed"], "round": result["rounds"], **said})
            print("BROKEN", said, flush=True)
            if stage.rig.process.poll() is not None:
                return
            watch.arm()
        result["rounds"] += 1


def one_round(stage: Stage, watch: Watch, harms: list[tuple[str, Any]], result: dict[str, Any]) -> None:
    names = [name for name, _ in harms]
    watch.forget()
    sets, refused = watch.sets, watch.refused
    panics = result["panics"]
    is_quick = len(names) == 1 and names[0].startswith("kill") and stage.chance.random() < 0.5
    begun = time.monotonic()
    with contextlib.ExitStack() as stack:
        for _, harm in harms:
            stack.enter_context(harm(stage))
        is_gateway_well = not {f"kill {GATEWAY}", f"stop {GATEWAY}"} & set(names)
        is_servo_well = not {f"kill {SERVO}", f"stop {SERVO}"} & set(names)
        over = begun + stage.chance.uniform(0.2, 4.0)

        def is_over() -> bool:
            watch.set_some()
            return time.monotonic() >= over

        if not is_quick:  # a set waits for a servo: how soon all is back would not be seen
            wait_for("the end of it", is_over)
        is_panicked = is_servo_well and stage.chance.random() < 0.4
        if is_panicked and is_gateway_well:
            panics["sent"] += 1
            took = watch.panicked(time.monotonic(), PANIC_WITHIN_S, repeated=False)
            panics["longest_s"] = max(panics["longest_s"], took)
            watch.assert_still()
        elif is_panicked and names == [f"kill {GATEWAY}"]:
            panics["after_a_kill"] += 1
            took = watch.panicked(begun, PANIC_AFTER_A_KILL_S, repeated=True)
            panics["longest_after_a_kill_s"] = max(panics["longest_after_a_kill_s"], took)
            watch.assert_still()
    took = watch.back(sounds=2)
    if any(name.startswith("flood") for name in names):
        # Some of the flood were good sets, and the last of them may still wait for the stick: nobody knows what holds.
        watch.accepted.clear()
    lost = watch.values_lost()
    result["values"]["accepted"] += watch.sets - sets
    result["values"]["refused"] += watch.refused - refused
    result["values"]["lost"] += len(lost)
    result["strikes"]["heard"] += len(watch.strikes.got)
    result["strikes"]["lost"] += watch.lost()
    for name in names:
        row = result["harms"].setdefault(name, {"rounds": 0, "strikes_lost": 0, "back_s": {}})
        row["rounds"] += 1
        row["strikes_lost"] += watch.lost()
        if not is_panicked and (is_quick or (len(names) == 1 and not name.startswith("kill"))):
            for part, seconds in took.items():
                count, total, most = row["back_s"].get(part, (0, 0.0, 0.0))
                row["back_s"][part] = [count + 1, total + seconds, max(most, seconds)]
    if lost:
        raise Broken("; ".join(lost))


def one_rig(result: dict[str, Any], seconds: float) -> None:
    """Start one, torture it for so long, and see that it ends as asked."""
    with (
        small_disk() as (state, is_small),
        tempfile.TemporaryDirectory(prefix="drumstick-clock-") as clock,
        jumping_clock(Path(clock)) as offset,
        running("up", state=state) as rig,
        contextlib.closing(Link(rig.zenoh_port)) as link,
        contextlib.closing(rig.client()) as session,
        contextlib.closing(rig.client()) as flooder,
        running("sound", "--connect", f"tcp/127.0.0.1:{link.port}", "--audio", "null", name=rig.name),
    ):
        harms = all_harms(offset)
        missing = [] if offset else ["clock jumps: no C compiler"]
        if not is_small:
            del harms["disk full"]
            missing.append("disk full: no root")
        result["not_tried"] = missing
        stage = Stage(rig, session, flooder, state, link, result["next_seed"])
        watch = Watch(stage)
        wait_for("strikes", lambda: watch.strikes.got)
        begun = time.monotonic()
        try:
            rounds(stage, watch, harms, result, begun + seconds)
        finally:
            watch.close()
            result["minutes"] += (time.monotonic() - begun) / 60.0
            result["next_seed"] += 1
        status = rig.stop()
        if status != 0:
            result["broken"].append(
                {"seed": result["next_seed"] - 1, "what": f"ended with {status}", "log": rig.lines[-5:]}
            )


def summary(result: dict[str, Any]) -> Iterator[str]:
    """A few lines for who ran it."""
    yield f"{result['minutes']:.0f} minutes, {result['rounds']} rounds, {len(result['broken'])} promises broken"
    for name in ("strikes", "values", "panics"):
        yield f"{name}: " + ", ".join(
            f"{k} {v:.3g}" if isinstance(v, float) else f"{k} {v}" for k, v in result[name].items()
        )
    for name, row in sorted(result["harms"].items()):
        back = ", ".join(
            f"{part} {total / count:.2f} ({most:.2f})" for part, (count, total, most) in row["back_s"].items()
        )
        yield f"{name}: {row['rounds']} rounds, {row['strikes_lost']} strikes lost; back, s, mean (most): {back}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--seed", type=int, help="of the first rig; else it goes on from the stored result")
    args = parser.parse_args()
    # Ended from outside, even in a shell's background, it ends its rig as well.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: sys.exit(130))
    result = stored.read("torture") if stored.exists("torture") else empty()
    result["next_seed"] = args.seed or result["next_seed"]
    until = time.monotonic() + 60.0 * args.minutes
    while (left := until - time.monotonic()) > 5.0:
        one_rig(result, min(left, A_RIG_S))
        stored.store("torture", result)
    print("\n".join(summary(result)))


if __name__ == "__main__":
    main()
