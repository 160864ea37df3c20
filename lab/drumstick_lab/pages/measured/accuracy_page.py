"""Writes docs/accuracy-and-time.md and its pictures from the shipped result: drumstick lab accuracy-page.

The result is lab/results/accuracy.json, by `drumstick lab accuracy`. Also writes what the panel carries of it. The words are in accuracy.template.md, its numbers come from the result.
"""

import hashlib
import json
from collections.abc import Callable, Iterable
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
from drumstick_lab.accuracy.sticks import falling
from drumstick_lab.accuracy.store import shipped, summary
from drumstick_lab.accuracy.whole import FALL_K_COLL, LOSSY, PLAIN, LOW_Hz
from drumstick_lab.checkout import DOCS
from drumstick_lab.measuring import stored
from drumstick_lab.measuring.provenance import line
from drumstick_lab.pages.measured.whole_way import octaves, set_ups
from drumstick_lab.pages.measured.whole_way import points as whole_points
from drumstick_lab.pages.measured.whole_way.set_ups import digits, measure_of, row_of
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


def _table(found: dict[str, Any], latency: Row) -> str:
    rows = [f"| {want} | {choose} | {costs} |" for want, choose, costs in choices(found, latency)]
    return "\n".join(["| if you want | choose | it costs |", "|---|---|---|", *rows])


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


def _measures(row: Row) -> str:
    # A dB is one JND of level, so it stands once; the threshold of an onset lies below what was tried.
    spectra = [digits(each["value"]) for each in row["measures"] if each["unit"] == "dB"]
    said = [f"{', '.join(spectra)} dB"] if spectra else []
    for each in row["measures"]:
        if each["unit"] != "dB":
            least = "at least " if "onset" in each["what"] and each["value"] > 0.0 else ""
            said.append(
                f"{each['what']} {digits(each['value'])} {each['unit']} ({least}{digits(each['jnds'])})"
            )
    return "; ".join(said)


def _percent(row: Row) -> str:
    return "" if row["share_of_core"] is None else f"{digits(100.0 * row['share_of_core'])} %"


def _late(row: Row) -> str:
    return f"{digits(row['latency_ms'])} ms"


def _memory(row: Row) -> str:
    return f"{1e-6 * row['memory_bytes']:.2f} MB"


def _few(row: Row) -> str:
    return f"{digits(1e-3 * row['memory_bytes'])} kB"


def _bytes(row: Row) -> str:
    return f"{row['memory_bytes']:.0f}"


_COSTS: dict[str, dict[str, Callable[[Row], str]]] = {
    "stick": {"of a core": _percent},
    "servo": {"of a core": _percent},
    "message": {"of a core": _percent, "bytes a strike": _bytes},
    "wire": {},
    "drum": {"of a core": _percent, "memory": _memory, "late by": _late},
    "effects": {"saves of a core": _percent, "saves memory": _few},
    "output": {},
}


def _stage(rows: list[Row], stage: str) -> str:
    # A reference stands among what is compared with it. What it was checked by is as far from it as its own row says.
    costs = _COSTS[stage]
    checked = [(row["playing"], row["measures"]) for row in rows if row["stage"] == "reference"]
    heads = ("playing", stage, "error, and in JND", "JND at worst", *costs)
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for row in rows:
        if row["stage"] == stage or (stage == "drum" and row["stage"] == "reference"):
            more = ", refused by the servo" if row.get("refused") else ""
            more = " (the reference)" if row["stage"] == "reference" else more
            cells = (
                row["playing"].replace("a fall,", f"a fall on {FALL_K_COLL:g} N/m,"),
                row["choice"] + more,
                "as the reference: unknown"
                if stage == row["stage"] and (row["playing"], row["measures"]) in checked
                else _measures(row),
                digits(row["jnds"]),
            )
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
    "stick": "a time step for the stick (it has none)", "servo": '`servo.predictor = "off"`',
    "message": "a stream on an arm of 1 kHz for plain strikes", "drum": "a mesh or bank that another beats",
}  # fmt: skip


def _never_words(rows: list[Row]) -> str:
    return "; ".join(dict.fromkeys(_NOBODY[row["stage"]] for row, _ in never(rows)))


def _never(rows: list[Row]) -> str:
    return "\n".join(f"- {row['stage']}, {named(row)}: {named(other)}" for row, other in never(rows))


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


def _first_words(rows: list[Row], lines: list[set_ups.SetUp], latency: Row) -> dict[str, Any]:
    # Numbers of the words below the first table.
    low = f"spectrum below {LOW_Hz / 1e3:g} kHz"
    felt = measure_of(
        row_of(rows, "servo", "a fall, the arm in time", "1000 Hz, predictor lead"), "impulse felt"
    )
    sent, streamed = (
        measure_of(row_of(rows, "message", "a press", choice), low)["value"]
        for choice in ("analytic", "streamed, 4000")
    )
    drums = [row for row in rows if row["stage"] == "drum"]
    late_ms = [row["latency_ms"] for line in lines for row in line.drums]
    decays = [each["value"] for row in drums for each in row["measures"] if each["what"] == "decay of a mode"]
    times = latency["rows"]
    soon_ms, measured_ms = (times[name]["sound_ms"]["p50"] for name in ("at_once", "streamed"))
    streamed_ms = row_of(rows, "wire", wire.TO_SOUND, "streamed, 4000 Hz")["latency_ms"]
    plain = {name: row_of(rows, "reference", name, "") for name in (*PLAIN, LOSSY)}
    checked = [row for name, row in plain.items() if name != LOSSY]
    default = [row_of(rows, "drum", name, "standard") for name in PLAIN]
    return {
        "checked_dB": _most(checked, *set_ups.COLUMNS),
        "checked_cents": _most(plain.values(), "pitch")[0],
        "checked_decays": tuple(_most(of, "decay of a mode")[0] for of in (checked, [plain[LOSSY]])),
        "louder_dB": sorted(row["louder_dB"] for row in default),
        "alike_dB": sorted(row["alike_dB"] for row in default),
        "octaves": "\n".join(octaves.table(rows)),
        "measured_ms": measured_ms,
        "felt": felt,
        "felt_N_per_m": FALL_K_COLL,
        "falls": f"{falling.PHASES} phases of the tick, at {falling.SPEED:g} m/s",
        "pressed_dB": sent,
        "heard_dB": streamed,
        "soon_ms": soon_ms,
        "streamed_ms": streamed_ms,
        "later_ms": streamed_ms - soon_ms,
        "drum_ms": latency["drum_ms"],
        "late_ms": (min(late_ms), max(late_ms)),
        "draft_jnds": digits(measure_of(row_of(rows, "drum", "snare", "draft"), "pitch")["jnds"]),
        "decay_percent": max(decays),
        "wood": _both_bands(row_of(rows, "message", "a blow by a wooden", "mallet")),
        "felt_mallet": _both_bands(row_of(rows, "message", "a blow by a felt", "mallet")),
    }


def _most(rows: Iterable[Row], *measures: str) -> list[float]:
    # The largest of each of these measures among the rows.
    found = list(rows)
    return [max(measure_of(row, what)["value"] for row in found) for what in measures]


def _both_bands(row: Row) -> str:
    below, whole = (digits(measure_of(row, what)["value"]) for what in set_ups.COLUMNS)
    return f"{below} dB below 4 kHz, {whole} dB in all bands"


def _same_drum(found: dict[str, Any]) -> tuple[float, float]:
    # Shares of a core that one and the same drum came to within one run.
    shares = [
        row["share_of_core"]
        for row in found["whole"]["rows"]
        if row["stage"] == "drum" and row["choice"].startswith("standard") and row["playing"] != "snare"
    ]
    alone_ns = next(row["ns_per_sample"] for row in found["effects"]["sample"] if row["effect"] == "none")
    shares.append(1e-9 * heads.DEVICE_RATE_Hz * alone_ns)
    return min(shares), max(shares)


def _lost(roll: dict[str, Any]) -> str:
    # None lost of n says only that the share is below 1 - 0.05^(1/n), at 95 %.
    said = f"of {roll['strikes']} strikes of a roll {roll['osc']['lost']} were lost"
    if roll["osc"]["lost"]:
        return said
    return f"{said}, so that fewer than {100.0 * (1.0 - 0.05 ** (1.0 / roll['strikes'])):.1f} % are (with 95 % confidence)"


def _finest(found: dict[str, Any], precision: str) -> Row:
    # The mesh of the most junctions by the scheme that `fine` has.
    rows = [
        row
        for row in found["mesh"]["rows"]
        if (row["scheme"], row["rim"], row["precision"]) == ("fourth", "weights", precision)
    ]
    return max(rows, key=lambda row: row["across"])


def _numbers(found: dict[str, Any]) -> dict[str, Any]:
    stick = {(row["method"], row["locates"], row["dt_s"]): row for row in found["stick"]["rows"]}
    exact = next(row for row in found["stick"]["rows"] if row["method"] == "exact")
    own = found["servo"]["rows"][0]["filter"]
    servo = {
        (row["k_coll"], row["rate_Hz"], row["delay_ticks"], row["predictor"]): row
        for row in found["servo"]["rows"]
        if row["filter"] == own
    }
    single, double = (_finest(found, precision) for precision in ("float32", "float64"))
    none, gateway = (
        found["effects"]["none"],
        stored.read("gateway_share")["rows"]["foreseen"]["rolling"]["share"],
    )
    latency, shares = stored.read("strike_latency"), stored.read("core_share")["rows"]
    streams = found["whole"]["streams"]
    rows = [*found["whole"]["rows"], *wire.rows(latency, streams)]
    lines = set_ups.set_ups(rows, shares["timpani"]["played"] - shares["timpani"]["ringing"])
    return {
        "line": line("accuracy"),
        "line_of_wire": line("strike_latency"),
        "quick_s": found["machine"]["quick_first_s"],
        "block": latency["block"],
        "computed_ms": streams["rows"][0]["sound_ms"]["p50"],
        "lost": _lost(stored.read("wire")["roll"]),
        "same_drum": _same_drum(found),
        "gateway": gateway,
        "elsewhere": shares["roll"]["ringing"],
        "snare_elsewhere": shares["snare"]["ringing"],
        "by_hand": sorted(row["over_by_hand_median"] for row in stored.read("composed")["rows"])[::2],
        "never_words": _never_words(rows),
        "minutes": found["machine"]["seconds"] / 60.0,
        "start": "\n".join(set_ups.table(lines, gateway)),
        **_first_words(rows, lines, latency),
        "table": _table(found, latency),
        "peers": _peers(found),
        "peers_rtol": _PEERS_RTOL,
        "exact_us": exact["ns_per_s"] / 1e3,
        "rk4_seen": stick["rk4", True, 1e-4],
        "rk4_unseen": stick["rk4", False, 1e-4],
        "off": _adds(servo[3500.0, 1000, 0, "off"]),
        "lead": _adds(servo[3500.0, 1000, 0, "lead"]),
        "late": _adds(servo[3500.0, 1000, 1, "lead"]),
        "none": none,
        "finest": single,
        "finest_64": double,
        "double_costs": double["ns_per_sample"] / single["ns_per_sample"],
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
