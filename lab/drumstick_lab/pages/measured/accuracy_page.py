"""Writes docs/accuracy-and-time.md and its pictures from the shipped result: drumstick lab accuracy-page.

The result is lab/results/accuracy.json, by `drumstick lab accuracy`. Also writes what the panel carries of it. The words are in accuracy.template.md, its numbers come from the result.
"""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from drumstick.perception import jnd
from drumstick_lab.accuracy import choices as choosing
from drumstick_lab.accuracy import figures, wire
from drumstick_lab.accuracy.choices import choices, named, never, worst_energy
from drumstick_lab.accuracy.drums import heads
from drumstick_lab.accuracy.figures import FIGURES
from drumstick_lab.accuracy.run import PARTS
from drumstick_lab.accuracy.stick import NEEDS, PEERS
from drumstick_lab.accuracy.store import shipped, summary
from drumstick_lab.accuracy.whole import LOW_Hz, MIDDLE_Hz
from drumstick_lab.checkout import DOCS
from drumstick_lab.measuring import stored
from drumstick_lab.measuring.provenance import line
from drumstick_lab.pages.measured import whole_points
from drumstick_lab.pages.stored_picture import digest_of, store
from rig.accuracy_files import SHIPPED
from rig.figures import style

IMAGES = DOCS / "images"
PAGE = DOCS / "accuracy-and-time.md"
_PEERS_RTOL = 1e-6

Row = dict[str, Any]

TEMPLATE = Path(__file__).parent / "accuracy.template.md"
POINTS = IMAGES / "accuracy-whole.svg"  # beside the PNG of that name, for the site
_SOURCES = tuple(Path(module.__file__) for module in (figures, style))
_SOURCES_OF_POINTS = (*_SOURCES, *(Path(module.__file__) for module in (choosing, whole_points)))


def _digest(part: dict[str, Any], sources: tuple[Path, ...] = _SOURCES) -> str:
    made_from = hashlib.sha256(json.dumps(part, sort_keys=True).encode())
    for path in sources:
        made_from.update(path.read_bytes())
    return made_from.hexdigest()


def stale_pictures() -> list[str]:
    """Names of pictures that are missing or were made from something else than the code and the result say now."""
    found, stale = shipped(), []
    for name, part, _ in FIGURES:
        path = IMAGES / f"{name}.png"
        if digest_of(path) != _digest(found[part]):
            stale.append(name)
    if whole_points.digest_of(POINTS) != _digest(found["whole"], _SOURCES_OF_POINTS):
        stale.append(POINTS.name)
    return stale


def _table(found: dict[str, Any]) -> str:
    rows = [f"| {want} | {choose} | {costs} |" for want, choose, costs in choices(found)]
    return "\n".join(["| if you want | choose | it costs |", "|---|---|---|", *rows])


def _digits(value: float) -> str:
    # Two digits, and no power of ten where a person would write none.
    return f"{value:.0f}" if 10.0 <= abs(value) < 1e5 else f"{value:.2g}"


def _of(rows: list[Row], stage: str, playing: str, choice: str) -> Row:
    return next(
        row
        for row in rows
        if row["stage"] == stage and row["playing"].startswith(playing) and row["choice"].startswith(choice)
    )


def _jnds(row: Row, what: str) -> float:
    return next(each["jnds"] for each in row["measures"] if each["what"] == what)


def _value(row: Row, what: str) -> float:
    return next(each["value"] for each in row["measures"] if each["what"] == what)


_HEARD, _LOW = f"spectrum below {MIDDLE_Hz / 1e3:g} kHz", f"spectrum below {LOW_Hz / 1e3:g} kHz"
_DEFAULT = "nothing: the default"


def _drums(rows: list[Row], tier: str) -> Row:
    # Of the playings on the default drum, the farthest off, at the highest cost.
    of = [_of(rows, "drum", playing, tier) for playing in ("roll", "accents")]
    worst = max(of, key=lambda row: _jnds(row, _HEARD))
    return worst | {"share_of_core": max(row["share_of_core"] for row in of)}


def _start(rows: list[Row]) -> str:
    # Whole set-ups: what servo, message and drum cost together, and the one of message and drum that is farther off.
    servo, faster = (
        _of(rows, "servo", "a fall, the arm in time", f"{rate} Hz, predictor lead") for rate in (1000, 4000)
    )
    message, press = (_of(rows, "message", playing, "analytic") for playing in ("a blow of", "a press"))
    stream = _of(rows, "message", "a press", "streamed, 4000")
    draft, standard, fine = (_drums(rows, tier) for tier in ("draft", "standard", "fine"))
    bank, snare = _of(rows, "drum", "timpani", "bank to 5000"), _of(rows, "drum", "snare", "standard")
    pressed = _of(rows, "drum", "press", "standard")
    soon, later, late = (each for each in rows if each["playing"] == wire.TO_SOUND)
    even = f"`drum.latency_s = {later['latency_s']:g}`"
    setups = (
        ("rolls, strikes, accents on stage", _DEFAULT, servo, message, soon, standard),
        ("the same, every stroke equally late", even, servo, message, later, standard),
        ("the same on a small machine", '`mesh.accuracy = "draft"`', servo, message, soon, draft),
        ("the same, heard alone or recorded", '`mesh.accuracy = "fine"`', servo, message, soon, fine),
        ("a snare on stage", _DEFAULT, servo, message, soon, snare),
        ("timpani", "`[modal]`, as scene `timpani` has it", servo, message, soon, bank),
        ("press rolls and buzz", _DEFAULT, servo, press, soon, pressed),
        (
            "presses as a hand makes them, on an arm of 4 kHz",
            '`drum.excitation = "streamed"`, `servo.rate_Hz = 4000`', faster, stream, late, pressed,
        ),
    )  # fmt: skip
    lines = [
        "| you play | choose | of a core | strike to sound card | off by below 4 kHz, and in all bands |",
        "|---|---|---|---|---|",
    ]
    for play, choose, arm, sent, onset, drum in setups:
        share = sum(row["share_of_core"] for row in (arm, sent, drum))
        below, whole = (
            _digits(max(_jnds(row, what) for row in (sent, drum))) for what in (_HEARD, "spectrum")
        )
        off = f"{below} dB, {whole} dB in all"
        if sent is stream:
            low = f"below {LOW_Hz / 1e3:g} kHz {_digits(_jnds(sent, _LOW))} dB, by a message {_digits(_jnds(press, _LOW))} dB"
            off = f"{off}; its force {low}"
        heard = f"{onset['latency_ms']:.1f} ms ± {_value(onset, 'spread of the onset'):.2f}"
        lines.append(f"| {play} | {choose} | {_digits(100.0 * share)} % | {heard} | {off} |")
    return "\n".join(lines)


def _peers(found: dict[str, Any]) -> str:
    # One tolerance for all; of a peer that was not there, what to install for its row.
    rows = {row["method"]: row for row in found["stick"]["rows"] if row["rtol"] == _PEERS_RTOL}
    rows["exact"] = next(row for row in found["stick"]["rows"] if row["method"] == "exact")
    codes = {peer: f"{needed[1]}, not noted which" for peer, needed in NEEDS.items()}
    codes |= {"exact": "this instrument"} | found["stick"].get("peers", {})
    lines = [
        "| method | by | error of ten contacts | a second of it | times `exact` |",
        "|---|---|---|---|---|",
    ]
    for method in ("exact", *PEERS):
        row = rows.get(method)
        if row is None:
            lines.append(f"| {method} | {codes[method]} | not measured | | |")
            continue
        error = row["error_contacts"] if method != "exact" else found["stick"]["exact_error"]
        times = row["ns_per_s"] / rows["exact"]["ns_per_s"]
        lines.append(
            f"| {method} | {codes[method]} | {error:.1g} | {1e-6 * row['ns_per_s']:.3g} ms | {times:,.0f} |"
        )
    return "\n".join(lines)


def _measures(row: dict[str, Any]) -> str:
    return "; ".join(
        f"{each['what']} {_digits(each['value'])} {each['unit']} ({_digits(each['jnds'])})"
        for each in row["measures"]
    )


def _percent(row: Row) -> str:
    return "" if row["share_of_core"] is None else f"{_digits(100.0 * row['share_of_core'])} %"


def _late(row: Row) -> str:
    return f"{_digits(row['latency_ms'])} ms"


def _memory(row: Row) -> str:
    return f"{1e-6 * row['memory_bytes']:.2f} MB"


def _few(row: Row) -> str:
    return f"{_digits(1e-3 * row['memory_bytes'])} kB"


def _bytes(row: Row) -> str:
    return f"{row['memory_bytes']:.0f}"


_COSTS: dict[str, dict[str, Callable[[Row], str]]] = {
    "stick": {"of a core": _percent},
    "servo": {"of a core": _percent, "late by": _late},
    "message": {"of a core": _percent, "bytes a strike": _bytes},
    "wire": {},
    "drum": {"of a core": _percent, "memory": _memory, "late by": _late},
    "effects": {"saves of a core": _percent, "saves memory": _few},
    "output": {},
}


def _stage(rows: list[Row], stage: str) -> str:
    # A reference stands among what is compared with it.
    costs = _COSTS[stage]
    heads = ("playing", stage, "error, and in JND", "JND at worst", *costs)
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for row in rows:
        if row["stage"] == stage or (stage == "drum" and row["stage"] == "reference"):
            more = ", refused by the servo" if row.get("refused") else ""
            more = " (the reference)" if row["stage"] == "reference" else more
            cells = (row["playing"], row["choice"] + more, _measures(row), _digits(row["jnds"]))
            lines.append(f"| {' | '.join((*cells, *(cell(row) for cell in costs.values())))} |")
    return "\n".join(lines)


def _saved(row: Row, added_ns: dict[str, float]) -> Row:
    # What an effect costs is measured by the part of the effects, in turn with the drum without it.
    share = 1e-9 * heads.DEVICE_RATE_Hz * added_ns[row["choice"].removeprefix("without ")]
    return row | {"share_of_core": share, "memory_bytes": row["saves_bytes"]}


def _whole(found: dict[str, Any], rows: list[Row]) -> str:
    added_ns = {row["effect"]: row["added_ns"] for row in found["effects"]["sample"]}
    told = [_saved(row, added_ns) if row["stage"] == "effects" else row for row in rows]
    return "\n\n".join(_stage(told, stage) for stage in _COSTS)


_NOBODY = {
    "stick": "a time step for the stick", "servo": "a servo without its lead",
    "message": "a stream for what a message says better", "drum": "a mesh or bank that another beats",
}  # fmt: skip


def _never_words(rows: list[Row]) -> str:
    worse: dict[str, list[str]] = {}
    for row, _ in never(rows):
        worse.setdefault(row["stage"], []).append(named(row))
    return "; ".join(f"{_NOBODY[stage]}: {', or '.join(names)}" for stage, names in worse.items())


def _never(rows: list[Row]) -> str:
    return "\n".join(
        f"- {row['stage']}, {named(row)}: {named(other)} is as true or truer, and costs no more."
        for row, other in never(rows)
    )


def _yardsticks(found: dict[str, Any]) -> str:
    # How far the same work's time differs between the parts: what costs of two parts may be compared to.
    each: dict[str, list[float]] = {}
    for part in PARTS:
        for name, ns in found[part]["yardstick_ns"].items():
            each.setdefault(name, []).append(ns)
    return ", ".join(f"{name} {min(ns):.3g} to {max(ns):.3g} ns" for name, ns in each.items())


def _adds(row: dict[str, Any]) -> dict[str, Any]:
    refused = "" if row["passes_envelope"] else ", and the servo refuses that set"
    return {"mean": row["energy"], "worst": worst_energy(row), "refused": refused}


def _numbers(found: dict[str, Any]) -> dict[str, Any]:
    stick = {(row["method"], row["locates"], row["dt_s"]): row for row in found["stick"]["rows"]}
    exact = next(row for row in found["stick"]["rows"] if row["method"] == "exact")
    own = found["servo"]["rows"][0]["filter"]
    servo = {
        (row["k_coll"], row["rate_Hz"], row["delay_ticks"], row["predictor"]): row
        for row in found["servo"]["rows"]
        if row["filter"] == own
    }
    none = found["effects"]["none"]
    latency = stored.read("strike_latency")
    rows = [*found["whole"]["rows"], *wire.rows(latency)]
    return {
        "line": line("accuracy"),
        "line_of_wire": line("strike_latency"),
        "quick_s": found["machine"]["quick_first_s"],
        "block": latency["block"],
        "roll": stored.read("wire")["roll"],
        "gateway": stored.read("gateway_share")["rows"]["foreseen"]["rolling"]["share"],
        "never_words": _never_words(rows),
        "minutes": found["machine"]["seconds"] / 60.0,
        "start": _start(rows),
        "draft_jnds": _digits(_jnds(_of(rows, "drum", "snare", "draft"), "pitch")),
        "felt_jnds": _digits(
            _of(rows, "servo", "a fall, the arm in time", "1000 Hz, predictor lead")["jnds"]
        ),
        "table": _table(found),
        "peers": _peers(found),
        "peers_rtol": _PEERS_RTOL,
        "exact_us": exact["ns_per_s"] / 1e3,
        "rk4_seen": stick["rk4", True, 1e-4],
        "rk4_unseen": stick["rk4", False, 1e-4],
        "off": _adds(servo[3500.0, 1000, 0, "off"]),
        "lead": _adds(servo[3500.0, 1000, 0, "lead"]),
        "late": _adds(servo[3500.0, 1000, 1, "lead"]),
        "none": none,
        "finest": max(
            (
                row
                for row in found["mesh"]["rows"]
                if (row["scheme"], row["rim"], row["precision"]) == ("fourth", "weights", "float32")
            ),
            key=lambda row: row["across"],
        ),
        "finest_64": max(
            (
                row
                for row in found["mesh"]["rows"]
                if (row["scheme"], row["rim"], row["precision"]) == ("fourth", "weights", "float64")
            ),
            key=lambda row: row["across"],
        ),
        "bank": next(row for row in found["mesh"]["rows"] if row["renderer"] == "modal"),
        "others": "; ".join(
            f"{row['renderer']}, {row['junctions']} junctions, {row['modes_found']} modes found, timed"
            f" {'in this run' if row['measured'] else row['of']}"
            for row in found["mesh"]["rows"]
            if row["renderer"] not in ("mesh", "modal") and row["rms_cents"] is not None
        ),
        "band_Hz": found["excitation"]["band_Hz"],
        "streamed_4000": next(row for row in found["excitation"]["rows"] if row["rate_Hz"] == 4000.0),
        "staircase": min(
            (row for row in found["mesh"]["rows"] if row["rim"] == "none"), key=lambda row: row["across"]
        ),
        "analytic": next(row for row in found["excitation"]["rows"] if row["kind"] == "analytic"),
        "streamed": next(row for row in found["excitation"]["rows"] if row["rate_Hz"] == 1000.0),
        "yardsticks": _yardsticks(found),
        "whole": _whole(found, rows),
        "whole_date": found["whole"]["date"],
        "whole_load": found["whole"]["load"],
        "never": _never(rows),
        "jnd": jnd,
    }


def page() -> str:
    """The page's text."""
    return TEMPLATE.read_text(encoding="utf-8").format(**_numbers(shipped()))


def main() -> None:
    """Write the page and what pictures are stale."""
    found = shipped()
    SHIPPED.write_text(summary(found), encoding="utf-8")
    stale = stale_pictures()
    for name, part, draw in FIGURES:
        if name in stale:
            store(draw(found[part]), IMAGES / f"{name}.png", _digest(found[part]))
    if POINTS.name in stale:
        text = whole_points.svg(found["whole"], _digest(found["whole"], _SOURCES_OF_POINTS))
        POINTS.write_text(text, encoding="utf-8")
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
