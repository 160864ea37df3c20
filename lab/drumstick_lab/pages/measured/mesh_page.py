"""Writes docs/mesh.md from the stored results: drumstick lab mesh-page."""

import math
from typing import Any

from drumstick_lab.checkout import DOCS
from drumstick_lab.measuring.provenance import heading
from drumstick_lab.measuring.stored import read
from drumstick_lab.pages.measured.measured_drums import SETS

PAGE = DOCS / "mesh.md"
# Of gcc's best step over ours, from so many junctions across.
_AIM, _AIM_FROM_ACROSS = 1.5, 32


def aim(rows: list[dict[str, Any]], lanes: int) -> str:
    """Sentence on where a result misses the aim beside gcc; lanes: floats in a vector of ours."""
    missed = [
        f"{row['across']} across ({row['gcc_over_ours']:.2f})"
        for row in rows
        if row["across"] >= _AIM_FROM_ACROSS and row["gcc_over_ours"] < _AIM
    ]
    found = f"missed at {' and '.join(missed)}" if missed else "met at all of them"
    return f"The aim from {_AIM_FROM_ACROSS} across is {_AIM} times the faster gcc. With {SETS[str(lanes)]} it is {found}."


def _kernel() -> list[str]:
    result = read("mesh_kernel")
    lines = [
        *heading("## Beside a compiler", "mesh_kernel"),
        "The same step, written in C as one would and on the same arrays, by gcc with `-O3 -march=native` and with",
        "`-Ofast -march=native -mprefer-vector-width=512`: the faster of the two.",
        "In waves: our step, eight of them in one pass over the mesh, each a strip behind the one before it. No drum is computed so, since what strikes",
        "and what is heard would have to be known eight steps ahead.",
        f"`drumstick lab mesh-kernel`. {result['gcc']}.",
        "",
        "| across | junctions | ours, ns per junction and step | gcc, ns per junction and step | gcc / ours | ours in waves | ours / in waves |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {row['across']} | {row['junctions']} | {row['ns']['ours']:.3f} | {row['gcc_over_ours'] * row['ns']['ours']:.3f} |"
        f" {row['gcc_over_ours']:.2f} | {row['ns']['in waves']:.3f} | {row['ns']['ours'] / row['ns']['in waves']:.2f} |"
        for row in result["kernels"]
    ]
    together = result["together"]
    lines += [
        "",
        aim(result["kernels"], result["lanes"]),
        "",
        f"Several drums of {together[0]['junctions']} junctions on one core, a block of {together[0]['block']} samples of each in turn, as the mixer plays them: a core's cache holds",
        "only one or two of them.",
        "",
        "| drums | ns of each, per junction and step | times one alone |",
        "|---|---|---|",
    ]
    lines += [
        f"| {row['drums']} | {row['ns']:.3f} | {row['ns'] / together[0]['ns']:.2f} |" for row in together
    ]
    lines += [
        "",
        "What the drum's effects cost, as a whole step of the default drum; `cavity`, `snare` and `sympathy` include a second head:",
        "",
        "| effect | ns a step | times a head without effects |",
        "|---|---|---|",
    ]
    lines += [
        f"| {name} | {row['ns_per_step']:.0f} | {row['ratio']:.2f} |"
        for name, row in result["effects"].items()
    ]
    lines += [
        "",
        "With `air` the mesh is smaller at the same f01, as the head is higher in pitch before the air lowers it, and beside a drum of",
        "that pitch without air the price grows with it; the goal is three times that ([0042](decisions/0042-air-on-a-mesh.md)).",
        "",
        "| f01 in air, Hz | junctions | ns a step | times a drum of that f01 without air | times the same mesh without air |",
        "|---|---|---|---|---|",
    ]
    lines += [
        f"| {row['f01_Hz']:g} | {row['junctions']} | {row['ns_per_step']:.0f} | {row['of_same_f01']:.2f} | {row['of_same_mesh']:.2f} |"
        for row in result["air"]
    ]
    lines += [
        "",
        "What microphones cost the default drum, with its mesh at two rates: ns for each microphone, per junction and step. `plain` is one loop for each",
        "run of neighbouring junctions whose sound arrives in the same step; both give the same sound.",
        "",
        "| mesh rate, Hz | junctions | a step without, ns per junction | microphones | ours, each | plain, each | plain / ours |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {mesh['rate_Hz']:g} | {mesh['junctions']} | {mesh['step_ns']:.3f} | {row['microphones']} | {row['ours']:.3f} | {row['plain']:.3f} |"
        f" {row['plain_over_ours']:.1f} |"
        for mesh in result["microphones"]
        for row in mesh["rows"]
    ]
    lines += [
        "",
        "The fourth order beside the second, a step of the default drum at the same mesh rate (16 kHz); cents: estimated rms error of the first twenty modes:",
        "",
        "| effects | second, ns a step | fourth | times | second, cents | fourth |",
        "|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {', '.join(row['effects']) or 'none'} | {row['ns_per_step']['standard']:.0f} | {row['ns_per_step']['fine']:.0f} |"
        f" {row['ratio']:.2f} | {row['cents']['standard']:.2f} | {row['cents']['fine']:.2f} |"
        for row in result["orders"]
    ]
    return lines


def _with_band(middle: float, band: tuple[float, float] | None, digits: int) -> str:
    # A median and its band, which results of before 2026-11-28 do not have.
    spread = "" if band is None else f" ({band[0]:.{digits}f}-{band[1]:.{digits}f})"
    return f"{middle:.{digits}f}{spread}"


def peers_goals(result: dict[str, Any]) -> list[str]:
    """Sentences on where the medians of a result miss the goals beside other instruments' meshes."""
    said: list[str] = []
    for label, goals in result.get("goals", {}).items():
        sizes = {
            name: row for name, row in result["times_ours"].items() if name.partition(" N = ")[0] == label
        }
        wanted = ", ".join(f"{peer} {goal:.3g}" for peer, goal in goals.items())
        missed = [
            f"{peer} at {name.partition(' N = ')[2]} across ({row[peer]['median']:.1f})"
            for name, row in sizes.items()
            for peer, goal in goals.items()
            if row[peer]["median"] < goal
        ]
        found = f"missed by {' and '.join(missed)}" if missed else "met at every size"
        said.append(f"The goals of `{label}` are {wanted} times its cost: {found}.")
    return said


def _peers() -> list[str]:
    result = read("mesh_peers")
    times = result["times_ours"]
    own = list(times)
    lines = [
        *heading("## Beside other instruments' meshes", "mesh_peers"),
        "`drumstick lab mesh-peers`. Theirs as Debian distributes them:",
        ", ".join(f"{name} {version}" for name, version in result["packages"].items()) + ".",
        "Faust's is compiled here with `g++ -O3 -march=native`. They differ in what they compute (waveguides on a square, or with filters",
        "at the rim): this is what a junction of each costs, not the same sound for less.",
        f"Median of {result['rounds']} rounds, in each of which every one of them runs once; in brackets the band in which the median lies with 95 % confidence. `ours` is for",
        "this processor, `ours AVX2` for one without AVX-512. SuperCollider's is the time of scsynth with a score less that with one without membranes, of the same",
        "round; at best: the least of the one less the least of the other.",
        "",
        "| mesh | junctions | ns a junction and sample | at best |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| {name} | {row['junctions']} | {_with_band(row['ns_median'], row.get('ns_band'), 3)} | {row['ns']:.3f} |"
        for name, row in result["rows"].items()
    ]
    lines += [
        "",
        "Cost of a junction of theirs, as a multiple of ours: median of the rounds' ratios.",
        "",
        f"| | {' | '.join(own)} |",
        f"|---|{'---|' * len(own)}",
    ]
    for peer in times[own[0]]:
        ratios = (_with_band(times[name][peer]["median"], times[name][peer].get("band"), 1) for name in own)
        lines.append(f"| {peer} | {' | '.join(ratios)} |")
    return [*lines, "", *peers_goals(result)]


def _composed() -> list[str]:
    result = read("composed")
    lines = [
        *heading("## What composing costs", "composed"),
        "A scene without effects beside a step written by hand for just that drum: once with the same pool of 32 overlapping blows, once with a single blow.",
        "`drumstick lab composed`.",
        "",
        "| junctions | composed, ns a step | by hand | ratio | by hand, one blow | ratio |",
        "|---|---|---|---|---|---|",
    ]
    return lines + [
        f"| {row['junctions']} | {row['composed_ns']:.0f} | {row['by_hand_ns']:.0f} | {row['over_by_hand']:.3f} |"
        f" {row['by_hand_one_blow_ns']:.0f} | {row['over_by_hand_one_blow']:.3f} |"
        for row in result["rows"]
    ]


def _live() -> list[str]:
    result = read("audio_live")
    lines = [
        *heading("## Live", "audio_live"),
        f"{result['junctions']} junctions, a step for every sample, {result['block']} frames at {result['rate_Hz']} Hz on JACK's dummy device, on"
        f" {result['threads']} threads",
        f"(`[mesh] threads`) of real-time priority {result['priority']}. On one thread the same blocks take {result['alone']:.0%} of the period."
        " `sorting` has a",
        "thread of pure Python in the same process. Shares of the period, of the best of"
        f" {len(result['p99_of_all_windows']['idle'])} windows; `ran` and `waited`: on a processor, and ready while others",
        "ran. The machine's own stalls are seen by real-time threads that only sleep.",
        "`drumstick lab audio-live`.",
        "",
        "| interpreter | blocks | p50 | p99 | max | ran, mean | waited, mean | more than half a period late | the same without stalls | xruns, as JACK counts them | stalls over 1 ms | longest stall, ms |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {name} | {row['blocks']} | {row['share']['p50']:.0%} | {row['share']['p99']:.0%} | {row['share']['max']:.0%} |"
        f" {row['ran_mean']:.0%} | {row['waited_mean']:.0%} |"
        f" {row['late']} | {row['late_excused']} | {row['xruns']} | {row['witnessed_stalls_over_1_ms']} |"
        f" {row['longest_stall_ms']:.1f} |"
        for name, row in result["rows"].items()
    ]
    return lines


_ROWS = {
    "at_once": "as soon as can be (`latency_s` 0)",
    "later": "`latency_s` longer than that took",
    "streamed": "streamed force (`latency_s` 0)",
}
_SHORT = {"at_once": "as soon as can be", "later": "with `latency_s`", "streamed": "streamed"}
_BESIDE = {
    "osc_ms": "strike to its OSC datagram",
    "zenoh_ms": "strike to a Zenoh subscriber",
    "bare_ms": "a bare datagram, from its thread's tick",
    "idle_ms": "lateness of an idle real-time thread",
    "callback_ms": "lateness of the listener's own callback",
}


# Half a radius at the head's speed of sound, which is 2 pi f01 radius / 2.405.
_TRAVEL_MS = 1e3 * 0.5 * 2.405 / (2.0 * math.pi * 150.0)


def _spread(found: dict[str, float]) -> float:
    return found["p99"] - found["p1"]


def _percentiles(found: dict[str, float]) -> str:
    return " | ".join(f"{found[at]:.2f}" for at in ("p1", "p50", "p99"))


def _latency() -> list[str]:
    result = read("strike_latency")
    rows, block_ms = result["rows"], 1e3 * result["block"] / result["rate_Hz"]
    later, port_ms = rows["later"], rows["at_once"]["port_ms"]
    counted = "; ".join(
        f"{words}: {rows[name]['strikes']} strikes, {rows[name]['unheard']} not heard, {rows[name]['late']} too late, {rows[name]['xruns']} xruns"
        for name, words in _SHORT.items()
    )
    lines = [
        *heading("## From a strike to its sound", "strike_latency"),
        f"From strike to sound: {rows['at_once']['sound_ms']['p50']:.1f} ms (median) to JACK, {rows['at_once']['sound_ms']['p50'] + port_ms:.1f} ms to the device; converters and air come on top.",
        f"`drumstick lab strike-latency`: a whole rig rolls on JACK's dummy device, {result['block']} frames at {result['rate_Hz']} Hz ({block_ms:.2f} ms each), and a client of JACK's is",
        "connected to the sound server's port. Each strike is isolated: the drum has died away before the next. From the contact's own instant to the first sample that is",
        "40 dB below a strike's peak, ms:",
        "",
        "| | p1 | p50 | p99 |",
        "|---|---|---|---|",
    ]
    for name, words in _ROWS.items():
        words += f", {later['latency_ms']:g} ms" if name == "later" else ""
        lines.append(f"| {words} | {_percentiles(rows[name]['sound_ms'])} |")
    out = {at: value + port_ms for at, value in rows["at_once"]["sound_ms"].items()}
    lines += [
        f"| the first of these where the sound leaves the device, as JACK tells ({port_ms:.2f} ms later) | {_percentiles(out)} |",
        "",
        f"These times are made of: until the tick's end (0 to {result['tick_ms']:g} ms), the gateway, the network, the sound server's reader, waiting for the next block (0 to {block_ms:.2f} ms), and of the",
        f"drum itself {result['drum_ms']:.2f} ms: its interpolator, and until the sound has risen to that level ({result['drum_louder_ms']:.2f} ms to 20 dB below the peak). The pickup is where the",
        f"stick strikes; one half a radius away hears a head of 150 Hz {_TRAVEL_MS:.1f} ms later. What JACK tells of the device is two",
        "blocks, one in its synchronous mode; then come converters and air. Streamed force waits for the piece of 2 ms that it comes in, for the two ticks after it and for the",
        "network, three pieces and a block in all ([0012](decisions/0012-streamed-force.md)).",
        "",
        f"With `latency_s` p99 - p1 is {_spread(later['sound_ms']):.2f} ms; that of a thread with nothing to do, in the same seconds, {_spread(later['idle_ms']):.2f} ms. Beside the sound, ms:",
        "",
        "| | " + " | | | ".join(_SHORT.values()) + " | | |",
        "|---|" + "---|" * 9,
        "| | " + " | ".join(["p1 | p50 | p99"] * 3) + " |",
    ]
    for kind, words in _BESIDE.items():
        lines.append(f"| {words} | " + " | ".join(_percentiles(rows[name][kind]) for name in _ROWS) + " |")
    lines += [
        "",
        f"{counted[0].upper()}{counted[1:]}. A frame of JACK's is put on the system's clock by the promptest of the callbacks around it.",
        "Gateway and the sound server's reader run at ordinary priority, so what else the machine does is in the tails.",
    ]
    return lines


def page() -> str:
    """The whole page."""
    lines = [
        "# What the mesh costs",
        "",
        "Made by `drumstick lab mesh-page` from `lab/results/`; do not edit. CPU time per junction and sample, measured alternately in"
        " short windows,",
        "the fastest window of each is shown. The machines were shared: trust the ratios.",
        "",
    ]
    for part in (_kernel, _peers, _composed, _live, _latency):
        lines += [*part(), ""]
    return "\n".join(lines)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
