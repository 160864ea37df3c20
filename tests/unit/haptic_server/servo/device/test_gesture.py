"""Recorded gestures: the strokes come at the instants of the file, in virtual time; what is wrong with it is said."""

from pathlib import Path

import numpy as np
import pytest

import sampled_arm
from drumstick.parameters.scene import Scene
from drumstick.scenes.recording import TrajectoryError
from drumstick.scenes.scene_text import parse, shipped_gesture, shipped_text
from drumstick.stick import hand_path as hand
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server import files
from haptic_server.records import NO_FAULT, RELEASE, STRIKE
from haptic_server.servo import loop
from haptic_server.servo.device.gesture import gesture_of
from haptic_server.servo.device.protocol import DeviceError
from haptic_server.servo.device.simulated import Simulated
from haptic_server.servo.force import memory

LIFT_S = 0.3  # a hand rests so long where its gesture begins
# The blows of accents.csv, s: the hand is lowest there, in from 45 mm for an accent and 20 mm for a tap.
ACCENTS = (0.4, 1.4, 2.4, 3.4)
TAPS = (0.9, 1.15, 1.9, 2.65, 2.9, 3.15, 3.65, 3.9)


def played(more: str = "") -> Scene:
    text = sampled_arm.SCENE.format(gesture="recorded", device=more, guard="").replace(
        "r_out_N_s_per_m = 0.5", "r_out_N_s_per_m = 2.0"
    )
    return parse(text + 'gesture_file = "mine.csv"\n', "arm")


def opened(scene: Scene, text: str, folder: Path) -> Simulated:
    (folder / files.GESTURE).write_text(text, encoding="utf-8")
    device = Simulated(scene, folder)
    device.open()
    return device


def servo_of(scene: Scene, text: str, folder: Path) -> memory.Servo:
    device = opened(scene, text, folder)
    block = blocks.in_memory(law_of(scene))
    return device.attach_simulation(memory.prepare(scene, block, specification=device.info().specification))


def strikes_of(servo: memory.Servo, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Instants from the gesture's first row, s, and speeds, m/s, of the strikes in so many seconds of it."""
    loop.run_virtual(servo, round(1e3 * (LIFT_S + seconds)), 0)
    assert servo.tick_state[0]["fault"] == NO_FAULT
    events = sampled_arm.events_of(servo)
    found = events[events["kind"] == STRIKE]
    assert np.count_nonzero(events["kind"] == RELEASE) == len(found)
    return found["t_ns"] * 1e-9 - LIFT_S, found["speed_m_per_s"]


def blows(*instants_s: float, length_s: float, low_m: float = -0.01, high_m: float = 0.025) -> str:
    """A file in which the hand goes down to each instant over 0.1 s, and up again."""
    rows = [(0.0, high_m)]
    for at in instants_s:
        rows += [(at - 0.1, high_m), (at, low_m), (at + 0.06, high_m)]
    rows.append((length_s, high_m))
    return "t_s,z_m\n" + "".join(f"{t:.4f},{z}\n" for t, z in rows)


def test_the_shipped_gesture_strikes_at_its_instants_and_again_when_it_repeats(tmp_path: Path) -> None:
    scene = parse(shipped_text("accents"), "accents")
    servo = servo_of(scene, shipped_gesture(scene.hand.gesture_file), tmp_path)
    instants, speeds = strikes_of(servo, 8.0)
    expected = sorted((*ACCENTS, *TAPS))
    assert len(instants) == 2 * len(expected)
    late = instants - np.concatenate([expected, np.array(expected) + 4.0])
    assert np.all((late > -0.005) & (late < 0.025))
    np.testing.assert_allclose(instants[12:] - instants[:12], 4.0, atol=1e-3)
    accents = np.isin(expected, ACCENTS)
    assert speeds[:12][accents].min() > 1.4 * speeds[:12][~accents].max()


@pytest.mark.parametrize("instants_s", [(0.3, 1.0, 1.45), (0.55, 0.9, 1.7), (0.2, 1.2)])
def test_uneven_strokes_come_when_they_were_recorded(tmp_path: Path, instants_s: tuple[float, ...]) -> None:
    servo = servo_of(played(), blows(*instants_s, length_s=2.0), tmp_path)
    found, _ = strikes_of(servo, 6.0)
    wanted = np.concatenate([np.array(instants_s) + 2.0 * n for n in range(3)])
    assert len(found) == len(wanted)
    late = found - wanted
    # Each the same way through the same spring: only what the last stroke left of swinging differs.
    assert np.all(np.abs(late) < 0.03)
    assert np.ptp(late) < 0.01


def test_the_head_may_lie_anywhere_in_the_workspace(tmp_path: Path) -> None:
    text = blows(0.3, 1.0, length_s=2.0)
    flat = strikes_of(servo_of(played(), text, tmp_path), 2.0)
    high = strikes_of(servo_of(played("head_z_m = 0.06"), text, tmp_path), 2.0)
    np.testing.assert_allclose(high[0], flat[0], atol=1e-3)
    np.testing.assert_allclose(high[1], flat[1], rtol=0.02)


def test_nanoseconds_spaces_other_columns_and_a_mark_before_the_first_name_do_no_harm() -> None:
    plain = gesture_of(blows(0.3, length_s=1.0).splitlines(), "mine.csv", played())
    lines = blows(0.3, length_s=1.0).splitlines()[1:]
    rows = [f"{7e18 + 1e9 * float(t):.0f}, 3, {z}" for t, z in (line.split(",") for line in lines)]
    other = gesture_of(["\ufefft_ns, place, z_m", *rows], "mine.csv", played())
    np.testing.assert_allclose(other, plain, atol=1e-6)


def test_the_hand_goes_back_unhurried_where_the_file_ends_elsewhere(tmp_path: Path) -> None:
    servo = servo_of(played(), "t_s,z_m\n0,0.05\n1,-0.005\n", tmp_path)
    gesture, path = servo.gesture[0], servo.path
    assert path[-1, 1] == path[0, 1] == 0.05
    way_back_s = path[-1, 0] - 1.0
    assert way_back_s == pytest.approx(0.055 / (0.25 * 1.5))
    t, before = 0.0, 0.05
    for _ in range(5000):
        t = hand.later(gesture, path, t, 1e-3)
        now = hand.hand_at(gesture, path, t)
        assert abs(now - before) <= 0.25 * 1.5 * 1e-3 * (1.0 + 1e-6)
        before = now


def test_the_arm_begins_where_its_hand_does(tmp_path: Path) -> None:
    """A hand far from the stick would throw it there, faster than the guard allows."""
    servo = servo_of(played(), "t_s,z_m\n0,0.29\n1,0.29\n2,0.0\n4,0.29\n", tmp_path)
    loop.run_virtual(servo, 200, 0)
    assert servo.tick_state[0]["fault"] == NO_FAULT
    assert servo.plant[0]["z_m"] == pytest.approx(0.29, abs=1e-6)
    assert np.abs(servo.trace["v_m_per_s"]).max() < 0.01


REFUSED = {
    "below the guard": ("t_s,z_m\n0,0.02\n1,-0.11\n", "mine.csv:3: z_m: -0.11 m is outside -0.1 .. 0.3 m"),
    "above the guard": ("t_s,z_m\n0,0.4\n1,0.1\n", "mine.csv:2: z_m: 0.4 m is outside -0.1 .. 0.3 m"),
    "too far aside": ("t_s,x_m,z_m\n0,0,0\n1,2,0\n", "mine.csv:3: x_m: 2 m is outside -1 .. 1 m"),
    "too fast": (
        "t_s,z_m\n0,0.02\n1,0.02\n1.1,0.12\n",
        "mine.csv:4: z_m: comes here at 1 m/s, faster than 0.75 m/s",
    ),
    "time back": ("t_s,z_m\n0,0\n1,0\n0.5,0\n", "mine.csv:4: t_s does not rise: 0.5 s after 1 s"),
    "time lost in rounding": (
        "t_s,z_m\n-1e300,0\n0,0\n1,0\n",
        "mine.csv:4: t_s does not rise: 1 s after 0 s",
    ),
    "no number": ("t_s,z_m\n0,0\n1,up\n", "mine.csv:3: z_m: 'up' is not a number"),
    "nan": ("t_s,z_m\n0,0\nnan,0\n", "mine.csv:3: t_s: nan is not a finite number"),
    "inf": ("t_s,z_m\n0,0\n1,-inf\n", "mine.csv:3: z_m: -inf is not a finite number"),
    "a short row": ("t_s,z_m\n0,0\n1\n", "mine.csv:3: z_m is missing in this row"),
    "decimal commas": ("t_s,z_m\n0,0,0,02\n", "mine.csv:2: 4 values for 2 names; decimals are written"),
    "a name twice": ("t_s,z_m,z_m\n0,0,0\n1,0,0\n", "mine.csv: has z_m more than once"),
    "no time": ("z_m\n0\n1\n", "needs the columns t_s (or t_ns) and z_m; it has z_m"),
    "one row": ("t_s,z_m\n0,0\n", "mine.csv: has 1 rows; a recording needs at least two"),
    "nothing": ("", "it has none"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_every_mistake_is_named_with_line_column_value_limit_and_unit(name: str) -> None:
    text, said = REFUSED[name]
    with pytest.raises(TrajectoryError) as refused:
        gesture_of(text.splitlines(keepends=True), "mine.csv", played())
    assert said in str(refused.value)


def test_a_file_that_is_not_there_or_not_text_ends_in_words(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match=r"gesture\.csv cannot be read: No such file"):
        Simulated(played(), tmp_path).open()
    (tmp_path / files.GESTURE).write_bytes(b"t_s,z_m\n0,\xff\n")
    with pytest.raises(DeviceError, match="utf-8"):
        Simulated(played(), tmp_path).open()
    with pytest.raises(DeviceError, match=r"mine\.csv:3: z_m"):
        opened(played(), "t_s,z_m\n0,0\n1,9\n", tmp_path)
    with pytest.raises(DeviceError, match="the folder is not known of the gesture"):
        Simulated(played()).open()


def test_it_tells_what_it_plays(tmp_path: Path) -> None:
    words = " ".join(opened(played(), blows(0.3, length_s=2.0), tmp_path).info().words)
    assert "recorded, mine.csv, 2 s, again and again" in words
