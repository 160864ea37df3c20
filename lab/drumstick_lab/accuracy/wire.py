"""Stage `wire` of the whole way: what comes of an onset between a strike and who hears of it, on a rig that played.

Read from lab/results/strike_latency.json (`drumstick lab strike-latency`), in the form of a row of the whole way. A
strike's place in its tick and its block is chance, so an onset has a latency, the median, and a spread: half of what
lies between the first and the last hundredth. Pure.
"""

from collections.abc import Iterator
from typing import Any

from drumstick.perception import jnd
from drumstick_lab.accuracy.whole import Measure, row_of

Row = dict[str, Any]
AT_ONCE, LATER, STREAMED = "at_once", "later", "streamed"
TO_SOUND, TO_OTHERS = "a strike to the sound card", "a strike to another program"


def spread_ms(times_ms: Row) -> float:
    """Half of p1 to p99, ms: to either side, as the threshold has it. More than a standard deviation."""
    return 0.5 * (times_ms["p99"] - times_ms["p1"])


def _row(playing: str, choice: str, times_ms: Row, latency_s: float = 0.0) -> Row:
    late_ms, spread = times_ms["p50"], spread_ms(times_ms)
    measures = [
        Measure("spread of the onset", spread, "ms", 1e-3 * spread / jnd.LATENCY_SPREAD_s),
        Measure("latency", late_ms, "ms", 1e-3 * late_ms / jnd.LATENCY_s),
    ]
    return row_of("wire", playing, choice, measures, latency_ms=late_ms) | {"latency_s": latency_s}


def rows(latency: Row, streams: Row) -> Iterator[Row]:
    """Rows of the stored result: to the sound server's port, at once, later and streamed; of a stream at the highest
    rate, computed (`streams` of the whole way); then to who listens elsewhere. ValueError for other blocks."""
    if streams["block"] != latency["block"]:
        raise ValueError(
            f"computed in blocks of {streams['block']}, measured in blocks of {latency['block']}"
        )
    found = latency["rows"]
    for name, choice in (
        (AT_ONCE, "analytic, as soon as can be"),
        (LATER, f"analytic, {found[LATER]['latency_ms']:g} ms after it"),
        (STREAMED, f"streamed, {1e3 / latency['tick_ms']:g} Hz"),
    ):
        yield _row(TO_SOUND, choice, found[name]["sound_ms"], 1e-3 * found[name]["latency_ms"])
    fastest = streams["rows"][-1]
    yield _row(TO_SOUND, f"streamed, {fastest['rate_Hz']:g} Hz, computed", fastest["sound_ms"])
    for key, choice in (("osc_ms", "OSC"), ("zenoh_ms", "Zenoh")):
        yield _row(TO_OTHERS, choice, found[AT_ONCE][key])
