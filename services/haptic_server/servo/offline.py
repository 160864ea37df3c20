"""The servo in virtual time, without a process: `drumstick.servo`, and its memory for others. Any thread; blocks."""

from dataclasses import dataclass
from io import StringIO
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from drumstick.drum.memory.strikes import OfflineStrike
from drumstick.parameters.scene import Scene, require_scene
from drumstick.public.plots import over_time
from drumstick.safety import envelope
from drumstick.safety.envelope import OutOfEnvelope
from drumstick.scenes.gesture import gesture_text
from drumstick.scenes.recording import TrajectoryError
from drumstick.scenes.scene_text import SceneError
from drumstick.stick.human.spread import NoSuchSpread
from drumstick.stick.law import law_of
from haptic_server import block
from haptic_server.limits import limits_of
from haptic_server.records import EVENT, FAULT_WORDS, STRIKE
from haptic_server.servo import loop
from haptic_server.servo.device.gesture import gesture_of
from haptic_server.servo.device.simulated import Simulated, require_uneven
from haptic_server.servo.force import memory
from haptic_server.servo.trace import ordered
from realtime import ring

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_AT_ONCE = 250  # ticks: of the trace's thousand, and a buzz of 64 events in each still finds room in the ring
# Column -> field of the trace, and of the event.
_TICK = {name: name for name in ("z_m", "v_m_per_s", "force_N")} | {"measured_z_m": "told_z_m"}
_STRIKE = {name: name for name in ("x", "y", "speed_m_per_s", "contact_s", "impulse_N_s", "level")} | {
    "peak_force_N": "peak_N"
}


@dataclass(frozen=True, repr=False)
class ServoRun:
    """Ticks and strikes of a servo that played offline. `fault`: words; empty unless one was latched, which ends it.

    ticks: structured array, shape (n,): `t_s`, height `z_m` and speed `v_m_per_s` that the force was computed from,
    `force_N` on the stick or arm, `measured_z_m` as the arm's encoders gave it (no meaning for the exact stick).
    strikes: structured array, shape (k,): `t_s`, place `x`, `y` in radii, `speed_m_per_s`, `level`, and what the strike
    announced of its contact: `peak_force_N`, `contact_s`, `impulse_N_s`.

    >>> import drumstick as ds
    >>> ds.servo(ds.scene("roll"), 1.0)
    ServoRun(roll: 1000 ticks at 1000 Hz, 23 strikes)
    """

    scene: Scene
    ticks: npt.NDArray[np.void]
    strikes: npt.NDArray[np.void]
    fault: str

    def drum_strikes(self) -> list[OfflineStrike]:
        """Blows that its strikes announced for the scene's drum."""
        return [
            OfflineStrike(t_s, x, y, peak, contact_s, impulse, self.scene.strike.stroke_at(level, speed))
            for t_s, x, y, speed, contact_s, impulse, level, peak in self.strikes.tolist()
        ]

    def plot(self) -> "Figure":
        """Height and force over time, drawn by matplotlib."""
        panels: dict[str, npt.ArrayLike] = {
            "height, mm": 1e3 * self.ticks["z_m"],
            "force on the stick, N": self.ticks["force_N"],
        }
        return over_time(self.scene.name, self.ticks["t_s"], panels)

    def __repr__(self) -> str:
        counted = f"{len(self.ticks)} ticks at {self.scene.servo.rate_Hz} Hz, {len(self.strikes)} strikes"
        return f"ServoRun({self.scene.name}: {counted}{self.fault and f', fault: {self.fault}'})"


def require_playable(scene: Scene) -> None:
    """Judge the scene's own set for its simulated device, as the servo does at its start.

    Raises OutOfEnvelope; SceneError where a hand that is no machine cannot be as uneven as asked for.
    """
    try:
        envelope.require(law_of(scene), limits_of(scene, Simulated(scene).info().specification))
    except OutOfEnvelope as refusal:
        raise OutOfEnvelope(f"{scene.name}: the scene itself is outside the envelope: {refusal}") from None
    if scene.hand.human is not None:
        try:
            require_uneven(scene)
        except NoSuchSpread as error:
            raise SceneError([f"{scene.name}: hand.human: {error}"]) from None


def servo_of(scene: Scene, gesture: str | None = None) -> memory.Servo:
    """Memory of the scene's servo with its simulated device, for virtual time; `gesture`: CSV text of a recorded one.

    Raises TrajectoryError where that is not good.
    """
    device = Simulated(scene)
    if gesture is not None:
        device.follow(gesture_of(StringIO(gesture, newline=""), scene.hand.gesture_file, scene))
    specification = device.info().specification
    own = block.in_memory(law_of(scene))
    return device.attach_simulation(memory.prepare(scene, own, specification=specification))


def servo(scene: Scene, duration_s: float, gesture: str | None = None) -> ServoRun:
    """Play the scene for duration_s (s) by the very tick that plays live, in virtual time.

    [device] plant says what it plays on: the exact stick, or with "phantom" a simulated arm as hardware is: sampled,
    with encoder counts, friction and delay, in a simulated hand that plays [hand] gesture. gesture: the CSV text of a
    recorded one that is not shipped, which moves the exact stick's hand too. What sampling does to a contact:
    docs/servo.md.

    Raises OutOfEnvelope where the live servo would refuse the scene; SceneError for a gesture that is not good or not
    there, and for a [hand.human] that cannot be as uneven as asked for; ValueError for a duration that is not above 0 s
    and below a day, and for a scene with two sticks.

    >>> import drumstick as ds
    >>> played = ds.servo(ds.scene("accents"), 2.0)
    >>> len(played.ticks), len(played.strikes) > 3, played.fault
    (2000, True, '')
    """
    require_scene(scene)
    if not 0.0 < duration_s < 86_400.0:
        raise ValueError(f"a duration of {duration_s:g} s: give one above 0 s and below a day")
    if scene.hand.why_not_live:
        raise ValueError(f"{scene.name} {scene.hand.why_not_live}")
    require_playable(scene)
    try:
        playing = servo_of(scene, gesture_text(scene, gesture))
    except TrajectoryError as error:
        raise SceneError([f"{scene.name}: hand.gesture_file: {error}"]) from None
    left, now_ns, seen = round(duration_s * scene.servo.rate_Hz), 0, 0
    ticks, events = list[npt.NDArray[np.void]](), list[npt.NDArray[np.void]]()
    drained = np.zeros(block.RING_SLOTS, EVENT)
    while left > 0:
        now_ns = loop.run_virtual(playing, min(left, _AT_ONCE), now_ns)
        left -= _AT_ONCE
        traced = int(playing.tick_state[0]["traced"])
        rows = ordered(playing.trace, traced)
        ticks.append(rows[len(rows) - (traced - seen) :])
        seen = traced
        events.append(drained[: ring.drain(playing.block.ring_cells, playing.block.events, drained)].copy())
    noted = np.concatenate(events)
    return ServoRun(
        scene,
        ticks=_columns(np.concatenate(ticks), _TICK),
        strikes=_columns(noted[noted["kind"] == STRIKE], _STRIKE),
        fault=FAULT_WORDS[int(playing.tick_state[0]["fault"])],
    )


def _columns(rows: npt.NDArray[np.void], fields: dict[str, str]) -> npt.NDArray[np.void]:
    found = np.zeros(len(rows), [(name, "f8") for name in ("t_s", *fields)])
    found["t_s"] = rows["t_ns"] * 1e-9
    for name, field in fields.items():
        found[name] = rows[field]
    return found
