"""`[hand]` as it may be written, with `[hand.human]`, and what only a hand and the rest of the scene can get wrong."""

from collections.abc import Mapping
from typing import Any, cast

from drumstick.parameters.declare import quantities
from drumstick.parameters.drum import Drum
from drumstick.parameters.rig import Device, Hand, Human
from drumstick.scenes.reading import Reader
from drumstick.stick.effects.registry import names_with

_HUMAN = "hand.human"


def _human(reader: Reader, given: object) -> Human | None:
    values = reader.values(_HUMAN, Human, given)
    entries = cast(dict[str, object], given) if isinstance(given, dict) else {}
    needed = [key for key in quantities(Human) if key != "seed"]
    missing = [key for key in needed if key not in entries]
    if isinstance(given, dict) and missing:
        reader.refuse(_HUMAN, f"needs {' and '.join(needed)}; missing: {', '.join(missing)}")
    return Human(**values) if all(key in values for key in needed) else None


def hand_of(reader: Reader, given: object) -> Hand:
    """The table as a Hand."""
    values = reader.values("hand", Hand, given, also_known=("human",))
    entries = cast(dict[str, object], given) if isinstance(given, dict) else {}
    if entries.get("human") is not None:  # None: as `as_tables` has a hand without
        values["human"] = _human(reader, entries["human"])
    return Hand(**values)


def check_hand(reader: Reader, hand: Hand, device: Device, drum: Drum, effects: Mapping[str, Any]) -> None:
    """Check a hand beside what it plays."""
    _check_gesture(reader, hand)
    _check_hands(reader, hand, device, drum)
    if hand.human is not None:
        _check_human(reader, hand, device, effects)


def _check_hands(reader: Reader, hand: Hand, device: Device, drum: Drum) -> None:
    if hand.hands == 1:
        return
    if hand.gesture in ("hold", "recorded"):
        reader.refuse("hand.hands", f'two hands take turns in a gesture, not in "{hand.gesture}"')
    if device.plant != "stick":
        reader.refuse("hand.hands", 'two sticks are not played by an arm: set [device] plant = "stick"')
    if drum.excitation == "streamed":
        reader.refuse("hand.hands", 'two sticks are heard by their strikes: not by excitation = "streamed"')


def _check_gesture(reader: Reader, hand: Hand) -> None:
    if hand.gesture != "recorded":
        if hand.gesture_file:
            reader.refuse("hand.gesture_file", 'is followed only by gesture = "recorded"')
        return
    if not hand.gesture_file:
        reader.refuse(
            "hand.gesture_file",
            "missing: a recorded gesture needs its CSV file, with t_s and z_m, k_hand_N_per_m or r_out_N_s_per_m",
        )


def _check_human(reader: Reader, hand: Hand, device: Device, effects: Mapping[str, Any]) -> None:
    if hand.gesture != "hold":
        reader.refuse(_HUMAN, f'varies a hand that holds still: not gesture = "{hand.gesture}"')
    if device.plant != "stick":
        reader.refuse(_HUMAN, "varies the exact stick's hand, not an arm's: set [device] plant = \"stick\"")
    if "pulse" not in effects:
        reader.refuse(_HUMAN, "varies a roll that a pulse keeps going: the scene needs [effects.pulse]")
    for name in (*names_with("NEVER_REPEATS"), *names_with("end_gain")):
        if name in effects:
            reader.refuse(
                _HUMAN, f"varies a roll that would else repeat strike by strike: not with [effects.{name}]"
            )
