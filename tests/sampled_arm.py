"""A servo with the simulated arm, for virtual time: made once per scene text, ticked by hand."""

import numpy as np

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse
from drumstick.stick.law import law_of
from drumstick.stick.motion import exact
from haptic_server import block as blocks
from haptic_server.records import EVENT, Reading
from haptic_server.servo.device.simulated import Simulated
from haptic_server.servo.force import memory
from haptic_server.servo.force.rendering import detect_events, render, requested_forces
from realtime import ring
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.jit import njit

PERIOD_NS = 1_000_000

SCENE = """
[stick]
m_kg = 0.075
k_coll_N_per_m = 3500.0
r_in_N_s_per_m = 2.5
k_hand_N_per_m = 60.0
r_out_N_s_per_m = 0.5
z_ss_m = -0.01
release = "unilateral"
[effects.pulse]
dv_m_per_s = 0.06
tau_s = 0.004
[guard]
max_force_N = 8.5
max_speed_m_per_s = 1.5
{guard}
[device]
plant = "phantom"
{device}
[hand]
gesture = "{gesture}"
"""


def scene(gesture: str = "strokes", device: str = "", guard: str = "") -> Scene:
    """Set E with a small pulse, on a simulated PHANTOM."""
    return parse(SCENE.format(gesture=gesture, device=device, guard=guard), "arm")


def servo_of(played: Scene) -> memory.Servo:
    """Its servo, in memory of its own."""
    device = Simulated(played)
    block = blocks.in_memory(law_of(played))
    return device.attach_simulation(memory.prepare(played, block, specification=device.info().specification))


def hold_at(servo: memory.Servo, z_m: float) -> None:
    """Put the exact stick there above the head, in m, at rest, from where it falls."""
    motion = servo.motion
    motion["z"], motion["v"], motion["contact_phase"], motion["outcome"] = z_m, 0.0, exact.ABOVE, exact.MOVING


def events_of(servo: memory.Servo) -> np.ndarray:
    """Strikes and releases since the last call."""
    out = np.zeros(16384, EVENT)
    return out[: ring.drain(servo.block.ring_cells, servo.block.events, out)]


@njit()
def render_once(servo: memory.Servo, reading: Reading, now_ns: int, span_s: float) -> float:
    """One tick's force, by the code that the loop compiles: for a servo that is lent."""
    return render(borrowed_view(servo), reading, now_ns, span_s)


@njit()
def ask_once(servo: memory.Servo, period_s: float) -> tuple[float, float]:
    """Force that the head and the pulses ask for, before the guard, N."""
    return requested_forces(borrowed_view(servo), period_s)


@njit()
def see_once(servo: memory.Servo, z: float, v: float, now_ns: int) -> None:
    """Tell it that the stick is at z m, v m/s."""
    detect_events(borrowed_view(servo), z, v, now_ns)
