"""Writes docs/scaling.md from the streams' rates and the stored results: drumstick lab scaling-page.

The model is counted here, from what one rig puts (lab/drumstick_lab/rig_load.py); what a router can carry is from
lab/results/listeners.json and wire.json.
"""

import math
from typing import Any, NamedTuple

from drumstick_lab.checkout import DOCS
from drumstick_lab.measuring.provenance import heading
from drumstick_lab.measuring.stored import read
from drumstick_lab.rig_load import (
    PROFILES,
    STREAMS,
    STRIKES_PER_S,
    payload_bytes_per_s,
    per_s,
)

PAGE = DOCS / "scaling.md"
COUNTS = (1, 3, 10, 30, 100, 300, 1000)
FAN_OUT = 30
_LATE_US = 50_000  # a strike that comes later is not played any more
_GATEWAY = "the gateway as router beside the servo (drumstick lab wire)"
_LATE = "99 of 100 strikes in time, simulated below"
_NO_MORE = "the most that were simulated below, in time"
_LINKS = {"100 Mbit/s": 12.5e6, "1 Gbit/s": 125e6}
_WORDS = {
    "follower": "strikes, releases, state: light, video, a recorder without force",
    "everything": "all that there is, of one rig and one sound server: a recorder with force beside an open panel",
}


class Router(NamedTuple):
    """Cost of one message at a router, fitted to the rows that lost nothing: us = own_us + each_us N."""

    own_us: float
    each_us: float
    bytes_each: float  # on the wire, for one delivery, headers and acknowledgements included

    def share(self, messages_per_s: float, receivers: float) -> float:
        """Share of one core."""
        return 1e-6 * messages_per_s * (self.own_us + self.each_us * receivers)


def whole(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows in which everything was delivered."""
    return [row for row in rows if row["delivered_share"] == 1.0]


def router_of(profile: dict[str, Any]) -> Router:
    """The straight line through what one put message cost; each row weighs by the inverse of its size."""
    rows = whole(profile["rows"])
    points = [(row["listeners"], row["router_cpu_us_per_delivery"] * row["listeners"]) for row in rows]
    weights = [1.0 / us**2 for _, us in points]
    total = sum(weights)
    n_mean = sum(w * n for w, (n, _) in zip(weights, points, strict=True)) / total
    us_mean = sum(w * us for w, (_, us) in zip(weights, points, strict=True)) / total
    spread = sum(w * (n - n_mean) ** 2 for w, (n, _) in zip(weights, points, strict=True))
    leaning = sum(w * (n - n_mean) * (us - us_mean) for w, (n, us) in zip(weights, points, strict=True))
    each_us = leaning / spread
    carried = rows[-1]["bytes_per_delivery"] * rows[-1]["listeners"] / (rows[-1]["listeners"] + 1)
    return Router(max(us_mean - each_us * n_mean, 0.0), each_us, carried)


def carried_by_the_gateway() -> float:
    """Deliveries a second that came in time, of those that drumstick lab wire tried."""
    in_time = [
        int(subscribers) * row["rate_Hz"]
        for subscribers, rows in read("wire")["ceiling"].items()
        for row in rows
        if row["lost_share"] == 0.0 and row["p99_us"] < _LATE_US
    ]
    return float(max(in_time))


def most_in_time(rows: list[dict[str, Any]]) -> int:
    """The most listeners that were tried of whom all got everything, and 99 of 100 strikes in time."""
    return max(row["listeners"] for row in whole(rows) if row["p99_us"] < _LATE_US)


def ceilings(name: str, router: Router, rows: list[dict[str, Any]]) -> dict[str, float]:
    """Number of listeners that each limit allows."""
    rate = per_s(name)
    found = {f"{words} link": speed / (rate * router.bytes_each) for words, speed in _LINKS.items()}
    found[_GATEWAY] = carried_by_the_gateway() / rate
    found["one core of a router"] = (1e6 / rate - router.own_us) / router.each_us
    in_time = most_in_time(rows)
    words = _LATE if any(row["listeners"] > in_time for row in rows) else _NO_MORE
    found[words] = float(in_time)
    return dict(sorted(found.items(), key=lambda item: item[1]))


def _load(name: str, router: Router, limits: dict[str, float], measured: set[int]) -> list[str]:
    rate = per_s(name)
    rows = [
        "| listeners | simulated below | messages/s | MB/s | share of a core | limits exceeded | tree: number of second-level routers"
        " | MB/s at the first router | share of a core, first | share of a core, each below |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for count in COUNTS:
        leaves = math.ceil(count / FAN_OUT)
        passed = [words for words, most in limits.items() if count > most]
        at_leaf = min(count, FAN_OUT)
        rows.append(
            f"| {count} | {'yes' if count in measured else 'no'} | {count * rate:,.0f} | {1e-6 * count * rate * router.bytes_each:.2f} |"
            f" {router.share(rate, count):.1%} | {'; '.join(passed) or '-'} | {leaves} |"
            f" {1e-6 * leaves * rate * router.bytes_each:.2f} | {router.share(rate, leaves):.1%} |"
            f" {router.share(rate, at_leaf):.1%} |"
        )
    return rows


def _profile(name: str, measured: dict[str, Any]) -> list[str]:
    router = router_of(measured)
    limits = ceilings(name, router, measured["rows"])
    first, most = next(iter(limits.items()))
    return [
        "",
        f"## Each listener hears {name}" if name == "everything" else f"## Each listener is a {name}",
        "",
        f"{_WORDS[name][0].upper()}{_WORDS[name][1:]}.",
        f"{per_s(name):.0f} messages and {1e-3 * payload_bytes_per_s(name):.1f} kB of payload a second",
        f"to each, {router.bytes_each:.0f} bytes a message on the wire.",
        f"A message costs the router {router.own_us:.0f} us, and {router.each_us:.1f} us for each that it goes to.",
        f"The first limit reached is **{first}**: {most:,.0f} listeners.",
        "",
        *_load(name, router, limits, {row["listeners"] for row in measured["rows"]}),
        "",
        "| limit | listeners |",
        "|---|---|",
        *(f"| {words} | {allowed:,.0f} |" for words, allowed in limits.items()),
    ]


def _compared(name: str, measured: dict[str, Any]) -> list[str]:
    router = router_of(measured)
    rows = [
        "",
        f"**{name}**",
        "",
        "| listeners | delivered | least to one | messages/s, model | measured | router us a delivery, model | measured |"
        " ratio to the one-listener row | p50 ms | p99 ms |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in measured["rows"]:
        count = row["listeners"]
        rows.append(
            f"| {count} | {row['delivered_share']:.2%} | {row['worst_listener_share']:.2%} |"
            f" {count * per_s(name):,.0f} | {row['delivered_per_s']:,} |"
            f" {(router.own_us + count * router.each_us) / count:.1f} | {row['router_cpu_us_per_delivery']:.1f} |"
            f" {row['cpu_to_one_listener']:.2f} | {1e-3 * row['p50_us']:.1f} | {1e-3 * row['p99_us']:.1f} |"
        )
    return rows


def _chained(chained: dict[str, Any]) -> list[str]:
    rows = [
        "",
        "## Routers behind routers",
        "",
        f"{chained['one router']['listeners']} listeners ({chained['profile']}) at the rig's own router, then all of them behind a",
        "second router that joins the first, then shared by two such routers. The first router sends each message once to",
        "each router behind it, however many listen there.",
        "",
        "| where | delivered | share of a core, first router | those behind | p50 ms | p99 ms |",
        "|---|---|---|---|---|---|",
    ]
    for name in ("one router", "behind a second", "behind two"):
        row = chained[name]
        own, *others = row["router_share_of_core"]
        behind = ", ".join(f"{share:.1%}" for share in others) or "-"
        rows.append(
            f"| {name} | {row['delivered_share']:.2%} | {own:.1%} | {behind} | {1e-3 * row['p50_us']:.1f} |"
            f" {1e-3 * row['p99_us']:.1f} |"
        )
    return rows


def _streams() -> list[str]:
    rows = ["| stream | a second | bytes of payload | follower | everything |", "|---|---|---|---|---|"]
    for name, stream in STREAMS.items():
        marks = ["x" if name in PROFILES[profile] else "" for profile in ("follower", "everything")]
        rows.append(f"| `{name}` | {stream.per_s:g} | {stream.payload_bytes} | {' | '.join(marks)} |")
    return rows


def most_tried(profiles: dict[str, Any]) -> int:
    """Listeners in the longest row of any profile."""
    return max(row["listeners"] for measured in profiles.values() for row in measured["rows"])


def page() -> str:
    """The whole page."""
    found = read("listeners")
    profiles: dict[str, Any] = found["profiles"]
    lines = [
        "# How many may listen",
        "",
        "Made by `drumstick lab scaling-page` from the streams' rates and the stored results; do not edit.",
        "",
        f"One rig that plays the scene `roll` ({STRIKES_PER_S:g} strikes a second) publishes the messages of the first table. Listeners on a",
        "network of several rigs add up: three rigs with ten listeners each load a router as one rig with thirty. The panel's",
        "surface, spectrum and cost are published only while somebody looks, the force only while somebody wants it.",
        "",
        *_streams(),
        "",
        f"**Nothing beyond {most_tried(profiles):,} listeners was simulated, and no real network was tried.** Computed, in every row:",
        "messages a second to all listeners; bytes by the interface's own counter; the router's processor time by a straight",
        f"line through what was measured below; trees, in which each router below the first has {FAN_OUT} listeners; the links, with",
        "their nominal speed (Wi-Fi, which sends each listener's copy through one air, was not tried). One core of a router is the",
        "same line, where it reaches all of a core; a router may use more of them. Lateness is measured, not computed: 99 of 100",
        "strikes within 50 ms, beyond which they are not played any more, at the numbers of listeners in the last tables.",
        f"The gateway's {carried_by_the_gateway():,.0f} deliveries a second were measured too, but elsewhere: strikes alone, listeners and servo on",
        "the same two cores, the most that",
        "`drumstick lab wire` saw with nothing lost and in time. This is the conservative figure: that more got through below, on",
        "another machine under other load, promises nothing elsewhere.",
    ]
    for name, measured in profiles.items():
        lines += _profile(name, measured)
    lines += [
        "",
        *heading("## Model and measurement", "listeners", "wire"),
        f"`drumstick lab listeners`, {found['seconds']:g} s each.",
        f"Router, rig and up to {max(row['listeners'] for row in profiles['follower']['rows'])} listeners",
        f"in {found['processes_of_listeners']} processes share these cores, over loopback, with other work: the load average was {found['load_before']:.1f} before. So the",
        "times are those of a machine that does everybody's work; the router's processor time is its own. Each listener is a",
        "session of its own. The ratio to the one-listener row is that of a delivery's processor time.",
    ]
    for name, measured in profiles.items():
        lines += _compared(name, measured)
    lines += _chained(found["chained"])
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
