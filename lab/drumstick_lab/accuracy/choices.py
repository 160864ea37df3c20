"""If you want this, choose that, it costs so much: read off a result of `drumstick accuracy`. Pure.

What is promised holds of the worst: of the mode that is farthest off, of the phase of the tick at which the arm falls.
What is to be chosen is told as it is typed, into a scene file or on the command line. What is off by less than a
twentieth of a just noticeable difference is recommended to nobody while something cheaper is not heard either.
"""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from drumstick.drum.effects.registry import NEEDS
from drumstick.drum.membrane.pitch_error import TWENTIETH
from drumstick.perception.jnd import pitch_jnd_cents, sharpest_Hz
from drumstick_lab.accuracy.drums import heads
from drumstick_lab.accuracy.sticks.falling import PHASES

Row = dict[str, Any]
# What a scene's [mesh] says beside its rate.
SCHEMES = {
    "limit": "",
    "fourth": '`mesh.accuracy = "fine"`, ',
    "lossless": '`mesh.courant = "lossless"`, ',
    "rectilinear": '`mesh.topology = "rectilinear"`, ',
}
_SMALL = 0.02  # of the coefficient of restitution: nobody's hand can tell
_LITTLE = 0.01  # of the energy before the contact
UNHEARD_JND = 0.05
_MUCH_LESS = 1.2  # times the cost: less is the machine's noise
_TOLD_FROM_NOTHING_ns = 20.0  # of what an effect adds to a sample
_JNDS = {1.0: "a", 0.5: "half a"}  # of pitch, in words


class Choice(NamedTuple):
    """One line of the table, in words."""

    want: str
    choose: str
    costs: str


def _cheapest(rows: list[Row], cost: str, good: Callable[[Row], bool]) -> Row | None:
    fitting = [row for row in rows if row[cost] is not None and good(row)]
    return min(fitting, key=lambda row: row[cost]) if fitting else None


def _of_stick(found: Row) -> Iterator[Choice]:
    # A time step is for comparison: the coarsest that is not felt costs more than the exact motion.
    exact = next(row for row in found["rows"] if row["method"] == "exact")
    yield Choice(
        "the stick’s motion itself",
        "nothing: it is exact",
        f"{exact['ns_per_s'] / 1e3:.2g} µs for a second of it",
    )


def _is_close(row: Row) -> bool:
    given = row["restitution"]
    return max(given["most"] - row["design"], row["design"] - given["least"]) <= _SMALL


def worst_energy(row: Row) -> float:
    """Energy that a contact adds at the worst phase of the tick, as a share of the energy before it."""
    return row["restitution"]["most"] ** 2 - row["design"] ** 2


def _adds_little(row: Row) -> bool:
    return worst_energy(row) <= _LITTLE


def _of_servo(found: Row) -> Iterator[Choice]:
    own = found["rows"][0]["filter"]  # the servo's; the others are what one might have taken instead
    rows = [
        row for row in found["rows"] if row["passes_envelope"] and row["filter"] == own and not row["missed"]
    ]
    wishes: tuple[tuple[str, Callable[[Row], bool]], ...] = (
        (
            f"the stiffest head that rebounds as set, within {_SMALL:g} of the speed",
            _is_close,
        ),
        (
            f"the stiffest head that added at most {100.0 * _LITTLE:g} % of energy, falling at"
            f" {found['design']['speed_m_per_s']:g} m/s at {PHASES} phases of the tick",
            _adds_little,
        ),
    )
    for wanted, good in wishes:
        fitting = [row for row in rows if good(row)]
        if fitting:
            hardest = max(row["k_coll"] for row in fitting)
            best = min(
                (row for row in fitting if row["k_coll"] == hardest), key=lambda row: row["share_of_core"]
            )
            delay = f", a device {best['delay_ticks']} ticks late" if best["delay_ticks"] else ""
            chosen = (
                f"`stick.k_coll_N_per_m = {hardest:g}`, `servo.rate_Hz = {best['rate_Hz']}`,"
                f' `servo.predictor = "{best["predictor"]}"`{delay}'
            )
            yield Choice(wanted, chosen, f"{100.0 * best['share_of_core']:.2g} % of a core")


def mesh_words(row: Row) -> str:
    """Words for a row of the mesh's table: the scene's own keys, and what they choose."""
    if row["renderer"] == "modal":
        return f"`modal.top_Hz = {row['bandwidth_Hz']:g}`: {row['junctions']} modes"
    keys = f"{SCHEMES[row['scheme']]}`mesh.rate_Hz = {row['rate_Hz']:g}`"
    return f"{keys}: {row['across']:.0f} junctions across"


def worst_cents(row: Row) -> float:
    """No mode is farther from its place: the worst beside the lowest, and the lowest itself."""
    return row["worst_cents"] + abs(row["f01_cents"])


def pitch_jnd(found: Row) -> float:
    """Just noticeable difference, cents, where the ear is sharpest among the first twenty modes of the part's drum."""
    return pitch_jnd_cents(sharpest_Hz(found["f01_Hz"], TWENTIETH * found["f01_Hz"]))


def _of_mesh(found: Row) -> Iterator[Choice]:
    def costs(row: Row) -> str:
        share = 1e-7 * row["ns_per_sample"] * found["device_rate_Hz"]
        return f"{share:.2g} % of a core"

    rows = [
        row
        for row in found["rows"]
        if row["renderer"] == "mesh" and row["precision"] == "float32" and row["rim"] == "weights"
    ]
    for jnds, words in _JNDS.items():
        cents = jnds * pitch_jnd(found)
        best = _cheapest(rows, "ns_per_sample", lambda row, most=cents: worst_cents(row) <= most)
        if best is not None:
            yield Choice(
                f"the lowest twenty modes in tune within {words} just noticeable difference: {cents:.1f} cents",
                mesh_words(best),
                costs(best),
            )
    wide = _cheapest(
        rows, "ns_per_sample", lambda row: row["bandwidth_Hz"] is not None and row["bandwidth_Hz"] >= 3000.0
    )
    if wide is not None:
        yield Choice("all modes up to 3 kHz in tune within 10 cents", mesh_words(wide), costs(wide))
    modal = _cheapest(found["rows"], "ns_per_sample", lambda row: row["renderer"] == "modal")
    if modal is not None:
        yield Choice(
            "a drum without tension and wires, every mode exact up to a top", mesh_words(modal), costs(modal)
        )


def _of_excitation(found: Row, latency: Row | None, streams: Row | None) -> Iterator[Choice]:
    # A latency that a rig was measured to have goes before one that is reckoned; none played at the highest rate.
    def late(row: Row) -> str:
        if latency is None:
            return f"{row['latency_ms']:.1f} ms, reckoned for blocks of 128 samples"
        if row["kind"] == "analytic":
            found_ms = latency["rows"]["at_once"]["sound_ms"]["p50"]
            return f"{found_ms:.1f} ms, measured in blocks of {latency['block']} samples"
        assert streams is not None, "a result without the whole way"
        found_ms = next(
            each["sound_ms"]["p50"] for each in streams["rows"] if each["rate_Hz"] == row["rate_Hz"]
        )
        return f"{found_ms:.1f} ms, computed for blocks of {streams['block']} samples"

    def costs(row: Row) -> str:
        differs = f"what differs below {found['band_Hz'] / 1e3:g} kHz is at {row['sound_error_dB']:.0f} dB of the sound"
        return f"{late(row)}; {differs}"

    for row in found["rows"]:
        if row["kind"] == "analytic":
            yield Choice("strikes with the least delay", '`drum.excitation = "analytic"`', costs(row))
    fastest = max((row for row in found["rows"] if row["kind"] == "streamed"), key=lambda row: row["rate_Hz"])
    yield Choice(
        f"press rolls by the hand's own force, on an arm whose driver runs at {fastest['rate_Hz'] / 1e3:g} kHz",
        f'`drum.excitation = "streamed"`, `servo.rate_Hz = {fastest["rate_Hz"]:g}`',
        costs(fastest),
    )


def _percent(ns_per_sample: float) -> float:
    return 1e-7 * ns_per_sample * heads.DEVICE_RATE_Hz


def _adds(added_ns: float, spread_ns: float) -> str:
    if added_ns < _TOLD_FROM_NOTHING_ns:
        return "too little to be told from nothing"
    return f"{_percent(added_ns):.2g} ± {_percent(spread_ns):.1g} % of a core more"


def _of_effects(found: Row) -> Iterator[Choice]:
    by_hand = found["none"]["over_by_hand"]
    none_ns = next(row["ns_per_sample"] for row in found["sample"] if row["effect"] == "none")
    added = {row["effect"]: row["added_ns"] for row in found["sample"]}
    yield Choice(
        "a drum and nothing else",
        "no table of effects",
        f"{_percent(none_ns):.2g} % of a core; {by_hand:.2f} times a drum written by hand for just that",
    )
    for row in found["sample"]:
        if row["effect"] not in ("none", "all"):
            needs = NEEDS[row["effect"]][0] if row["effect"] in NEEDS else ""
            other = f"from `{needs}` alone" if needs else "without it"
            changes = (
                "" if row["changes_dB"] is None else f"; {other} the change is at {row['changes_dB']:+.0f} dB"
            )
            added_ns = sum(added[name] for name in (needs, row["effect"]) if name)
            tables = [f"`[drum.effects.{name}]`" for name in (needs, row["effect"]) if name]
            yield Choice(
                f"`{row['effect']}`" + (f", with the `{needs}` that it needs" if needs else ""),
                " and ".join(tables),
                f"{_adds(added_ns, row['spread_ns'])}{changes}",
            )


def choices(found: Row, latency: Row | None = None) -> list[Choice]:
    """Choices of all parts that the result has, in their order. latency: the stored result of a rig that played."""
    readers: dict[str, Callable[[Row], Iterator[Choice]]] = {
        "stick": _of_stick,
        "servo": _of_servo,
        "mesh": _of_mesh,
        "excitation": lambda part: _of_excitation(part, latency, found.get("whole", {}).get("streams")),
        "effects": _of_effects,
    }
    return [choice for part, read in readers.items() if found.get(part) for choice in read(found[part])]


def named(row: Row) -> str:
    """Choice of a row of the whole way, in words."""
    return f"{row['choice']} ({row['playing']})"


def never(rows: list[Row]) -> list[tuple[Row, Row]]:
    """Rows of the whole way that nobody should choose, each with one of its stage and playing that is as true in every
    measure and costs less, or is so and, at its worst, twice as true for no more. What is below a twentieth of a JND is
    as true as anything. References are no choices, nor is what the servo refuses; and a message that guesses at a hand
    is nothing better than a stream that knows it."""
    priced = [
        row
        for row in rows
        if row["share_of_core"] is not None and row["stage"] != "reference" and not row.get("refused", False)
    ]
    found: list[tuple[Row, Row]] = []
    for row in priced:
        better = [
            other
            for other in priced
            if (other["stage"], other["playing"]) == (row["stage"], row["playing"])
            and not other.get("guesses", False)
            and _late(other) <= _late(row)
            and _is_as_true(other, row)
            and (
                _MUCH_LESS * other["share_of_core"] < row["share_of_core"]
                or (2.0 * _truth(other) <= _truth(row) and other["share_of_core"] <= row["share_of_core"])
            )
        ]
        if better:
            found.append((row, min(better, key=lambda other: other["share_of_core"])))
    return found


def _truth(row: Row) -> float:
    return max(row["jnds"], UNHEARD_JND)


def _is_as_true(other: Row, row: Row) -> bool:
    own, due = ({each["what"]: each["jnds"] for each in found["measures"]} for found in (other, row))
    return all(own[what] <= max(jnds, UNHEARD_JND) for what, jnds in due.items())


def _late(row: Row) -> float:
    return row["latency_ms"] or 0.0
