"""The limits for docs/safety.md: what is limited, its value from the code, what enforces it, which test shows it."""

from types import ModuleType
from typing import Any

from drumstick.parameters import rig
from drumstick.parameters.declare import quantities
from drumstick.safety import envelope, sampled_contact
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick_lab.checkout import TESTS
from haptic_server.servo.device.openhaptics import device, freshness
from haptic_server.servo.force import guard
from haptic_server.specification import PREMIUM_1_5

SCENE = parse(shipped_text("phantom"), "phantom")


def constant(module: ModuleType, name: str) -> Any:
    """A constant that its module keeps for itself; a new name there is an error here."""
    return vars(module)[name]


def _tests(*named: str) -> str:
    # `folder/file.py::function`, each checked; the table shows the files.
    files: list[str] = []
    for one in named:
        file, function = one.split("::")
        if f"def {function}(" not in (TESTS / file).read_text(encoding="utf-8"):
            raise LookupError(f"docs/safety.md names a test that is not there: tests/{one}")
        if file not in files:
            files.append(file)
    return ", ".join(f"`{file}`" for file in files) or "none yet"


def _key(name: str) -> str:
    # A key of [guard]: its value in the scene `phantom`, default and range.
    quantity = quantities(rig.Guard)[name]
    present, default = getattr(SCENE.guard, name), getattr(rig.Guard(), name)
    if quantity.choices:
        return f"`{name}`: {present} in `phantom`; {' or '.join(str(c) for c in quantity.choices)}"
    return f"`{name}`: {present:g} {quantity.unit} in `phantom`; default {default:g}, may be {quantity.low:g} .. {quantity.high:g}"


def table(rows: list[tuple[str, ...]]) -> str:
    """Rows as Markdown, the first as its head."""
    head, *body = rows
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, ("---",) * len(head), *body))


GUARD = "unit/haptic_server/servo/force/test_guard.py"
RENDERING, FENCES = "unit/haptic_server/servo/force/test_rendering.py", "unit/haptic_server/test_fences.py"
ENVELOPE, LIVE = "unit/drumstick/safety/test_envelope.py", "stability/servo/test_live_sets.py"
HD, PLAYS = "unit/haptic_server/servo/device/openhaptics", "system/test_haptic_plays.py"
LATCHED = f"{RENDERING}::test_a_fault_is_zero_force_on_the_same_tick_and_latched"


def before() -> str:
    """Limits that act before it plays."""
    both = "envelope, twice: gateway, servo"
    return table(
        [
            ("limited", "value", "enforced by", "when it is reached", "test"),
            (
                "speed that a roll can reach; on the simulated stick also after the throw that starts it",
                f"{_key('max_speed_m_per_s')}",
                both,
                "the whole set is refused, with the number, the limit and what to lower",
                _tests(
                    f"{ENVELOPE}::test_what_is_predicted_bounds_what_is_played",
                    f"{ENVELOPE}::test_a_refusal_has_words",
                    f"{FENCES}::test_the_gateways_fence_refuses_the_whole_set",
                    f"{FENCES}::test_the_servos_fence_refuses_the_whole_set_and_plays_on",
                    f"{LIVE}::test_a_stick_stays_within_the_envelope_whatever_comes_when",
                    f"{LIVE}::test_both_fences_say_the_same",
                ),
            ),
            (
                "force that head and pulses can ask for in that roll",
                f"{_key('max_force_N')}; never more than the device says it has",
                both,
                "the same",
                _tests(
                    f"{ENVELOPE}::test_nothing_unusable_passes",
                    f"{LIVE}::test_a_stick_stays_within_the_envelope_whatever_comes_when",
                ),
            ),
            (
                "stiffness, on an arm",
                "the nominal stiffness that the driver tells",
                both,
                "the same",
                _tests(f"{RENDERING}::test_the_servos_fence_knows_the_device"),
            ),
            (
                "a late force that feeds an arm energy instead of damping it",
                "`r_in` must be larger than `k_coll` times the mean delay of the force (half a tick plus `[device] delay_ticks`); all of `r_in` counts here, the hand's `r_out` in it",
                both,
                "the same",
                _tests(
                    f"{RENDERING}::test_what_the_envelope_refuses_would_have_given_energy_and_the_guard_takes_it_back"
                ),
            ),
            (
                "an arm that would keep moving in the head by itself",
                "Left alone in the head, the arm must come to rest, and every blow must come back slower than it came, but for what pulses and other effects that add energy give. In detail: the poles of the sampled loop lie inside the unit circle, without a hand and in the firmest grip. Every blow in that"
                f" grip comes back at less than {sampled_contact.MAX_REBOUND:g} of its speed, or, where the ideal head itself returns more, {constant(sampled_contact, '_LIVELY'):g}"
                f" times that and {constant(sampled_contact, '_MAX_OWN'):g} at most, at {constant(sampled_contact, '_PHASES')} phases of the tick."
                " For the lightest and the heaviest arm that the device declares",
                both,
                "the same",
                _tests(*SELF_MOVING),
            ),
            (
                "roughness by single encoder counts, on an arm",
                f"The steps of the position sensor must not be felt as a tremble. In detail: one sensor step (count) may change the speed by {sampled_contact.MAX_VELOCITY_STEP_M_PER_S * 1e3:g} mm/s a tick, by way of the damper, less the later the force comes. A blow of {sampled_contact.SLOW_M_PER_S * 1e3:g} mm/s, or up to a tenth more, seen in counts, comes back at {sampled_contact.MAX_SLOW_REBOUND:g} of its speed at most; for that the head holds back {sampled_contact.SLOW_REBOUND_REDUCTION:.0%} of its push while so slow a blow leaves. Three masses from the lightest arm to the heaviest",
                both,
                "the same",
                _tests(*SELF_MOVING),
            ),
            (
                "a contact so short that it is a buzz",
                f"{envelope.SHORTEST_CONTACT_S * 1e3:g} ms at least",
                both,
                "the same",
                _tests(f"{ENVELOPE}::test_a_refusal_has_words"),
            ),
            (
                "a change in the middle of a contact",
                "a set takes effect above the head only",
                "servo (`latch.py`)",
                "it waits",
                _tests(f"{RENDERING}::test_k_coll_is_latched_above_the_head_only"),
            ),
        ]
    )


# `none yet` on the page while one of these is empty.
SELF_MOVING: tuple[str, ...] = (
    "stability/servo/test_held_arm.py::test_what_is_accepted_comes_to_rest",
    "unit/drumstick/safety/test_sampled_contact.py::test_stable_is_what_the_eigenvalues_of_one_tick_say",
)
SELF_DRIVEN: tuple[str, ...] = (
    "stability/servo/test_held_arm.py"
    "::test_a_head_that_drives_the_arm_is_a_fault_though_the_account_is_wrong",
    f"{GUARD}::test_thirteen_contacts_in_a_row_that_begin_in_debt_are_a_fault",
    f"{GUARD}::test_contacts_at_the_limit_of_force_faster_than_a_hand_strikes_are_a_fault",
)
SOFT_STOP: tuple[str, ...] = (
    f"{RENDERING}::test_the_workspace_ends_softly_and_without_a_fault",
    f"{GUARD}::test_near_the_lowest_position_the_force_is_a_share_of_the_motors_not_of_what_is_asked",
)


def always() -> str:
    """Limits watched on every tick."""
    servo = "guard"
    most_owed, owed = constant(guard, "_FAULT_EXCESS_M_PER_S"), constant(guard, "_EXCESS_M_PER_S")
    contacts = constant(guard, "_MAX_DRIVEN")
    return table(
        [
            ("limited", "value", "enforced by", "when it is reached", "test"),
            (
                "force",
                f"{_key('max_force_N')}; never more than the device says it has",
                f"{servo}; once more in this program's device module (`openhaptics/tick.py`); the driver's own clamp, if it came on",
                "the force is cut",
                _tests(
                    f"{RENDERING}::test_force_and_slew_stay_within_the_limits",
                    f"{HD}/test_callback.py::test_no_more_force_than_the_device_has",
                    "unit/haptic_server/servo/device/test_conformance.py::test_no_force_beyond_the_devices_own",
                ),
            ),
            (
                "change of force",
                _key("max_slew_N_per_s"),
                f"{servo}; the driver's own impulse limit, if it came on",
                "the force follows more slowly (20000 N/s at 1 kHz are 20 N a tick: with a force limit below 10 N this limit never acts). What the energy account, a fault or a panic takes away goes at once",
                _tests(
                    f"{RENDERING}::test_force_and_slew_stay_within_the_limits",
                    f"{LIVE}::test_an_arm_is_never_given_more_than_its_account",
                ),
            ),
            (
                "force at the start, and after anything took it away",
                f"none until the tip was {constant(guard, '_SEEN_ABOVE_M') * 1e3:g} mm above the head, then a ramp. {_key('ramp_s')}",
                servo,
                "-",
                _tests(
                    f"{RENDERING}::test_nothing_is_rendered_before_the_stick_was_above_the_head",
                    f"{RENDERING}::test_only_arm_ends_a_fault_and_only_above_the_head",
                    f"{GUARD}::test_the_ramp_is_a_share_of_the_motors_too",
                ),
            ),
            (
                "energy that the head gives the arm",
                "what the arm brought into the contact, and what the effects in the scene are meant to add. Energy given beyond that is deducted from the next"
                f" contact's allowance; an unused allowance is not saved. Counted for an arm of {PREMIUM_1_5.moving_kg[0] * 1e3:g} g, the lightest declared",
                f"{servo}; what effects may add comes from the same bounds as in the envelope",
                "the head pushes less",
                _tests(
                    f"{LIVE}::test_an_arm_is_never_given_more_than_its_account",
                    f"{GUARD}::test_what_a_contact_gave_too_much_is_owed_by_the_next_and_what_it_kept_is_not_saved",
                    f"{GUARD}::test_a_head_in_debt_pushes_no_stick_that_leaves_and_brakes_one_that_comes",
                ),
            ),
            (
                "a rendered head that keeps feeding energy to the arm",
                "The head must not hammer by itself. In detail, a fault is: an excess in one contact that is larger than the kinetic energy of the"
                f" lightest declared arm at {most_owed:g} m/s, and than {constant(guard, '_FAULT_EXCESS_SHARE'):.0%} of what this contact came in with; or more than {contacts}"
                f" contacts in a row that begin with an excess larger than that arm's energy at {owed:g} m/s; or more than {contacts} contacts in a row,"
                f" each less than {constant(guard, '_FASTEST_HAND_NS') * 1e-6:g} ms after the one before it, which reached"
                f" {constant(guard, '_AT_THE_LIMIT'):.0%} of the force limit without a pulse, and each faster than"
                f" {constant(guard, '_UNTIRED'):.0%} of the first one's speed",
                servo,
                "latched fault",
                _tests(*SELF_DRIVEN),
            ),
            (
                "speed up or down",
                _key("max_speed_m_per_s"),
                f"{servo}; the driver's own speed limit, if it came on",
                "latched fault",
                _tests(LATCHED),
            ),
            (
                "vertical position",
                f"{_key('lowest_m')}. {_key('highest_m')}",
                servo,
                f"the force of the head fades over the last {constant(guard, '_SOFT_M') * 1e3:g} mm above the lowest place; outside there is none,"
                " and it comes back by the ramp from above the head. No fault",
                _tests(*SOFT_STOP),
            ),
            (
                "time between two ticks, on an arm",
                f"over {guard.STALL_PAUSE_S * 1e3:g} ms a pause, over {guard.STALL_FAULT_S * 1e3:g} ms a fault",
                servo,
                "pause: no force, then the ramp from above the head; fault: latched",
                _tests(
                    f"{FENCES}::test_a_stall_of_an_arm_is_a_pause_and_then_a_fault",
                    f"{FENCES}::test_a_clock_that_goes_back_is_a_fault_of_an_arm",
                    f"{HD}/test_freshness.py::test_a_longer_stall_is_a_fault_until_somebody_arms_and_lifts",
                ),
            ),
            (
                "old positions",
                f"fault when no new position has come for {guard.STALE_S * 1e3:g} ms. One that repeats bit for bit counts as new all the same, because an arm may rest, unless"
                f" it does so right after motion faster than {freshness.MOVING_M_PER_S:g} m/s, or has for {freshness.PRESSING_S:g} s while the force exceeds {freshness.PRESSING_N:g} N",
                f"this program's device module (`openhaptics/freshness.py`) and {servo}",
                "latched fault",
                _tests(
                    f"{RENDERING}::test_a_device_that_tells_nothing_new_is_stale",
                    f"{HD}/test_freshness.py::test_a_driver_that_freezes_in_mid_stroke_gets_no_force_after_ten_milliseconds",
                    f"{HD}/test_freshness.py::test_a_driver_that_freezes_under_a_press_is_noticed_after_a_second",
                ),
            ),
            (
                "values that are not numbers",
                "position, force, time",
                f"{servo}; once more in this program's device module",
                "no force on the same tick, latched fault",
                _tests(
                    LATCHED,
                    f"{FENCES}::test_a_force_that_is_no_number_is_a_fault_on_the_same_tick",
                    f"{HD}/test_callback.py::test_a_law_that_answers_nonsense_moves_nothing",
                ),
            ),
            (
                "what the driver reports: force error, warm motors, safety switch, lost connection",
                "any error",
                "this program's device module (`openhaptics/tick.py`), whatever the guard says",
                "no force on the tick that sees it. Force errors, warmth and switch: latched. Lost connection or timer: the process ends too. A safety switch counts from the first time it was seen closed",
                _tests(
                    f"{HD}/test_callback.py::test_what_passes_leaves_no_force_until_somebody_arms",
                    f"{HD}/test_callback.py::test_a_device_that_is_gone_gets_no_force_and_no_further_call",
                    f"{HD}/test_callback.py::test_while_something_is_wrong_even_a_deaf_law_moves_nothing",
                    f"{HD}/test_callback.py::test_a_switch_that_was_never_closed_is_taken_for_none",
                ),
            ),
            (
                "a driver that calls no more",
                f"{constant(device, '_SILENT_S'):g} s",
                "servo process, outside the force loop",
                "it switches force output off and says so",
                _tests(f"{HD}/test_device.py::test_a_driver_that_falls_silent_is_noticed_and_told"),
            ),
            (
                "playing without a hand on the stylus (if you switch it on)",
                f"{_key('dead_man')}. Any button counts",
                servo,
                "no force on the tick that sees it let go; back by the ramp from above the head",
                _tests(f"{RENDERING}::test_dead_mans_button"),
            ),
            (
                "panic",
                "from the page, OSC, Zenoh, `drumstick panic`; a tuning lock does not stop it",
                "gateway to servo by shared memory; the servo latches it",
                "no force from the next tick on. `drumstick arm` on the machine with the arm gives it back; so does a reboot, or a new `drumstick up`, `drumstick haptic` or container (part 3)",
                _tests(
                    f"{RENDERING}::test_panic_is_zero_force_on_the_same_tick",
                    "unit/haptic_server/servo/device/test_conformance.py::test_a_panic_takes_all_force_away_until_it_is_armed",
                    f"{PLAYS}::test_panic_stops_the_force_until_armed_here",
                    f"{PLAYS}::test_an_acknowledged_set_and_a_panic_outlive_servo_and_gateway_together",
                    "system/test_presets_and_lease.py::test_a_panic_needs_no_lease",
                ),
            ),
            (
                "stopping the program in a contact",
                "-",
                "this program's device module",
                "the last force sent is zero, then force output is switched off",
                _tests(
                    "unit/haptic_server/servo/device/test_conformance.py::test_no_force_is_left_when_it_stops_in_mid_contact",
                    f"{HD}/test_callback.py::test_the_last_frame_before_the_end_has_no_force",
                ),
            ),
        ]
    )
