"""The hand of a recorded gesture, tick by tick: the exact stick's, which is its law, and the one that holds an arm.
A hand that is no machine ([hand.human]) is one of the exact stick's, whose gesture moves nothing.

What is set live is the hand that the gesture plays on (drumstick.stick.moving_hand), and what is judged: so the law has
its values back while sets are looked at. A grip or a height that would turn the stick's place into more speed than may
meet the head waits for a tick at which it does not. Tick thread: no allocation, no locks, no Python, no exceptions.
"""

from drumstick.safety import entry_speed, envelope
from drumstick.stick import composition, moving_hand
from drumstick.stick.hand_path import LIFTED_S
from drumstick.stick.human import unevenness
from haptic_server.servo.force.memory import Servo
from realtime.kernels.jit import njit, only_with


@only_with("moving")
def put_back(servo: Servo) -> None:
    """Give the law of the exact stick the values that are set."""
    moving_hand.put_back(servo.moving[0], servo.law[0])


@only_with("moving")
def take(servo: Servo) -> None:
    """A set has become the law: the hand plays its gesture on that."""
    moving_hand.take(servo.moving[0], servo.law[0])


@only_with("moving")
def may_lift(servo: Servo) -> None:
    """The tick ends in the midst of the motion: no rest is for ever in a hand that lifts."""
    moving_hand.may_lift(servo.moving[0], servo.motion[0])


@njit()
def _speed_ahead(servo: Servo) -> float:
    law, motion = servo.law[0], servo.motion[0]
    return entry_speed.speed_ahead(law, motion, law.z_ss, composition.most_remaining_speed(law, motion))


@only_with("moving")
def follow(servo: Servo, span_s: float) -> None:
    """Hold the exact stick for the `span_s` seconds of this tick as the gesture does."""
    hand, law = servo.moving[0], servo.law[0]
    moving_hand.hold(hand, law)
    share, damping, height_m, before = hand.share, hand.damping, hand.height_m, _speed_ahead(servo)
    moving_hand.go_on(hand, servo.moving_path, span_s)
    moving_hand.hold(hand, law)
    if not _speed_ahead(servo) <= max(before, servo.tick_state[0].max_entry_speed):
        hand.share, hand.damping, hand.height_m = share, damping, height_m
        moving_hand.hold(hand, law)


@only_with("moving")
def release(servo: Servo) -> None:
    """The stick has just left the head: a hand that is no machine changes."""
    moving_hand.release(servo.moving[0], servo.law[0], servo.motion[0])


@only_with("moving", otherwise=1.0)
def pressing(servo: Servo) -> float:
    """Factor that the hand makes of a z_ss below 0 now."""
    return unevenness.pressing(servo.moving[0])


@only_with("moving", otherwise=True)
def passes_at_worst(servo: Servo) -> bool:
    """True when the set in servo.pending_set is safe, too, in the worst that the hand makes of it.

    That is its highest place of a gesture, whose firmest and loosest grip is the set itself. Keeps what the judgement
    tells, as `latch.passes` does.
    """
    hand, tick_state, law = servo.moving[0], servo.tick_state[0], servo.pending_set[0].law
    if not moving_hand.makes_worse(hand):
        return True
    z_ss, dv_pls = law.z_ss, unevenness.pulse_of(hand, law)
    moving_hand.hold_worst(hand, law)
    judgement = envelope.judge(law, servo.envelope_limits[0], servo.scratch)
    law.z_ss = z_ss
    unevenness.set_pulse(hand, law, dv_pls)
    tick_state.pending_max_entry_speed = min(tick_state.pending_max_entry_speed, judgement.max_entry_speed)
    return judgement.code == envelope.OK


@only_with("gripping")
def grip(servo: Servo, max_speed: float) -> None:
    """Hold the simulated arm as firmly as the gesture does now, or as keeps it within `max_speed` m/s.

    A hand that closes about a stretched spring would else pump the arm up, as one that swings with it would.
    """
    hand, plant = servo.gripping[0], servo.plant[0]
    moving_hand.look(hand, servo.moving_path, max(plant.t_s - LIFTED_S, 0.0))
    wanted = hand.share * hand.k_hand
    stretch = plant.z_m - plant.hand_m
    fits = plant.m_kg * max(max_speed * max_speed - plant.v_m_per_s * plant.v_m_per_s, 0.0)
    if wanted * stretch * stretch > fits:
        wanted = min(wanted, max(plant.k_hand_N_per_m, fits / (stretch * stretch)))
    plant.k_hand_N_per_m = wanted
    plant.r_out_N_s_per_m = hand.r_out + hand.damping
