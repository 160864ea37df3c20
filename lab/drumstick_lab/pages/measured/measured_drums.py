"""The part of docs/measured.md that sets the scenes' drums beside recorded ones, from the stored result."""

import statistics
from typing import Any

from drumstick_lab.measuring.made_beside import BESIDE_ALL, KINDS, scene_of
from drumstick_lab.measuring.provenance import heading
from drumstick_lab.measuring.stored import read

CONVERGES = 0.5  # the least order that is one: a logarithm of the spacing shows less


def _row(name: str, drum: dict[str, Any], beside: str, away: str) -> str:
    soft, hard = (" ".join(f"{level:.0f}" for level in drum[key]) for key in ("softest_dB", "hardest_dB"))
    decays = " ".join("-" if value is None else f"{value:.2f}" for value in drum["t60_s"])
    rise = "-" if drum["rise_dB"] is None else f"{drum['rise_dB']:.1f}"
    return f"| {name} | {drum.get('place', '')} | {soft} | {hard} | {rise} | {drum['flatness']:.3f} | {decays} | {beside} | {away} |"


def _about(kind: str, ours: dict[str, Any]) -> list[str]:
    # What makes a comparison unequal.
    lines = [
        f"`{name}` is heard by pickups on its head, which no recording is."
        for name in ours
        if not scene_of(name).listen.microphones
    ]
    if kind == "tom":
        lines += [
            "The mesh of `tom` leaves room for its glide, so at rest its waves end at 6 kHz: what lies above is lost."
        ]
    if kind == "hand drum":
        lines += [
            "None of these is a conga: a djembe is a goblet, a bongo small and tight. They say how bright a drum under a hand is, not how a conga sounds.",
            "The djembes have one dynamic, so nothing says how a stroke of theirs grows brighter; most recordings end after 0.3 to 0.5 s. Held out are two bongos of one kit.",
        ]
    return lines


def _judged(found: dict[str, Any]) -> list[str]:
    # Scenes and recorded drums of each kind beside the held-out kits, and what the distance is made of.
    lines = [
        "",
        "Judged by kits that nothing was tuned to, kind by kind. Part of a distance, for toms most of it, is one number for each recording: how loud everything above",
        "500 Hz is beside the low end, which microphones, equalisers and the ring of the lowest modes set. The tables have what it is made of: by how much our",
        "bands differ, median of the held-out drums, and the distance that is left when all are made equally bright: without that one number.",
    ]
    for kind, real in found.get("real_from_held_out_dB", {}).items():
        ours = {
            name: drum
            for name, drum in found["scenes"].items()
            if KINDS[name][0] == kind and "held_out_bands_dB" in drum
        }
        tuned = [name for name, drum in ours.items() if drum["made_beside"]] or list(ours)
        pairs = [apart for name in tuned for apart in ours[name]["distance_dB"]["held_out"].values()]
        lines += [
            "",
            f"How much real {kind}s of different kits differ, by the same measure, median of each from those of other kits, dB: "
            f"{', '.join(f'{name} {apart:.1f}' for name, apart in sorted(real.items(), key=lambda row: row[1]))}"
            f" (median {statistics.median(real.values()):.1f}). Over {', '.join(f'`{name}`' for name in tuned)} and all held-out drums together:"
            f" {statistics.median(pairs):.1f}.",
            "",
            "| scene | 0.5-1, 1-2, 2-4, 4-8, 8-16 kHz, dB | distance, dB | when equally bright, dB |",
            "|---|---|---|---|",
        ]
        lines += [
            f"| {name} | {' '.join(f'{level:+.0f}' for level in drum['held_out_bands_dB'])} | {drum['median_held_out_dB']:.1f} |"
            f" {drum['median_held_out_but_for_level_dB']:.1f} |"
            for name, drum in ours.items()
        ]
        if about := _about(kind, ours):
            lines += ["", *about]
    return lines


def kept_rows(found: dict[str, Any]) -> list[str]:
    """Drums of a result of `beside_recordings` that were measured before the others, in a line; none without."""
    older = "; ".join(f"`{name}` {when}" for name, when in found.get("kept", {}).items())
    return [f"Measured earlier than the others, and kept: {older}."] if older else []


def recordings() -> list[str]:
    """Lines of the section."""
    found = read("beside_recordings")
    lines = [
        "",
        *heading("## Drums beside recorded ones", "beside_recordings"),
        "`drumstick lab beside-recordings`: each drum is struck five times, softest to hardest, and compared with drum kits that Debian packages for Hydrogen",
        "(some have 3 to 8 strokes).",
        "",
        "- place: where it is struck, share of the radius. 0.3 for the drums of a drum set, as no kit says where theirs were; the others where their scene plays them",
        "- softest, hardest: level of the bands 0.5-1, 1-2, 2-4, 4-8, 8-16 kHz relative to the whole stroke, dB",
        "  (1.5 s of it; of what rings longer, timpani and frame drum, levels below -60 dB are mostly that cut)",
        "- rise: of 1-8 kHz, from the softest stroke to the brightest",
        "- flatness: spectral flatness from 0.5 to 8 kHz, 0 for a tone and 1 for noise, median of the strokes",
        "- T60: of the hardest stroke, in the octaves from 63 Hz to 8 kHz; -: not measurable",
        "- the last two: distance, by how much the levels of the bands differ on average over all strokes; smaller is nearer. First from the recordings that the",
        "  scene was tuned to, then from kits that nothing was tuned to (held out; median over all their drums of that kind, floor toms included). -: it was",
        "  made beside none in particular; no recording: none of these kits has a timpano or a frame drum. A tom lies between two recordings of its size, whose kits differ in brightness",
        "  by up to 20 dB; Colombo's toms are recorded at one dynamic. Forzee, Colombo, Millo, BJA and Black Pearl are names of kits",
        "- no kit has a recorded conga (the two of ElectricEmpireKit are synthesised, as its author says). `conga` is fitted to other hand drums, open tones of five",
        "  djembes (circAfrique, one dynamic each), and judged by two bongos (Gimme A Hand, five dynamics)",
        "",
        "| drum | place | softest dB | hardest dB | rise dB | flatness | T60 s | distance from its recording, dB | distance from other kits, dB |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, drum in found["scenes"].items():
        made, away = drum["made_beside"], drum["distance_dB"].get("work")
        both = [name for name in (made, drum.get("made_also_beside")) if name]
        if name in BESIDE_ALL:
            beside = f"{drum['median_work_dB']:.1f} ({BESIDE_ALL[name]})"
        else:
            beside = (
                "no recording" if away is None else ", ".join(f"{away[it]:.1f} ({it})" for it in both) or "-"
            )
        held = drum.get("median_held_out_dB")
        lines.append(_row(f"`{name}`", drum, beside, "-" if held is None else f"{held:.1f}"))
    for kind in found["recordings"].values():
        lines += [
            _row(f"{name} (recorded)", drum, "", "")
            for drums in kind.values()
            for name, drum in drums.items()
        ]
    apart = [
        f"{pair} {value:.1f}"
        for kind in found["among_recordings_dB"].values()
        for pair, value in kind.items()
    ]
    lines += ["", *kept_rows(found)]
    return [*lines, "", f"The recordings among themselves, dB: {'; '.join(apart)}.", *_judged(found)]


SETS = {"16": "AVX-512", "8": "AVX2", "4": "SSE or Neon"}


def bank() -> list[str]:
    """Lines of the section on what a mode of a bank costs."""
    result = read("modal_bank")
    lines = [
        "",
        *heading("## A bank of modes", "modal_bank"),
        f"`drumstick lab modal-bank`: a ringing bank, computed in blocks of {result['block']} steps (where nothing couples its modes; under `tension` in 16, but for its",
        "lowest modes) and step by step (while a mallet plays). ns for each mode and step, in stereo; the ratio is of the same run. In brackets: with two pulses acting, as they do for some",
        f"milliseconds after strikes. Each number is the least of {result['rounds']} runs, which take turns. AVX2: the same processor, compiled for one without AVX-512.",
        "",
        "| vectors | bank | modes | hears | in blocks, ns | one by one, ns | ratio | in blocks, of a core at 48 kHz |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for lanes, rows in result["lanes"].items():
        for row in rows:
            ns, pulses = row["ns"], row["pulses"]
            both = [f"{ns[name]:.3f} ({pulses[name]:.3f})" for name in ("in_blocks", "one_by_one")]
            share = ns["in_blocks"] * 1e-9 * row["modes"] * 48_000
            lines.append(
                f"| {SETS[lanes]} | {row['f01_Hz']:g} Hz to {row['top_Hz'] / 1e3:g} kHz | {row['modes']} | {row['hears']} |"
                f" {' | '.join(both)} | {ns['ratio']:.1f} ({pulses['ratio']:.1f}) | {share:.1%} |"
            )
    return [*lines, *_coupled(result.get("coupled"))]


def _coupled(of_each: dict[str, list[dict[str, Any]]] | None) -> list[str]:
    # None in a result that was stored before they were measured.
    if of_each is None:
        return [
            "",
            "Under `tension`, and while a mallet is pressed in, a mode costs more; this result has no rows of it.",
        ]
    lines = [
        "",
        "Under `tension`, and while a mallet is pressed in, as the shipped toms play; here nothing else acts:",
        "",
        "| vectors | bank | modes | tension | mallet | ns | of a core at 48 kHz |",
        "|---|---|---|---|---|---|---|",
    ]
    for lanes, rows in of_each.items():
        for row in rows:
            tension, mallet = ("yes" if row[name] else "no" for name in ("tension", "mallet"))
            lines.append(
                f"| {SETS[lanes]} | {row['f01_Hz']:g} Hz to {row['top_Hz'] / 1e3:g} kHz | {row['modes']} | {tension} | {mallet} | {row['ns']:.3f} |"
                f" {row['ns'] * 1e-9 * row['modes'] * 48_000:.1%} |"
            )
    return lines


def shares() -> list[str]:
    """Lines of the section on what each shipped drum takes of a core."""
    result = read("core_share")
    lines = [
        "",
        *heading("### Share of a core", "core_share"),
        f"`drumstick lab core-share`: the drum of each scene at {result['rate_Hz']} Hz while it rings (`drumstick scene cost` says the same) and under"
        f" {result['strokes_per_s']} strokes a second; the dearest quarter of a second of these. Medians of {result['runs']} runs, CPU time."
        " Built: processor seconds until the drum is there, in a process of its own, without imports and compiling.",
        "",
        "| scene | junctions or modes | rings | is played | dearest | below a quarter | built, s |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, row in result["rows"].items():
        size = f"{row['size']} {'modes' if row['is_modal'] else 'junctions'}"
        cells = " | ".join(f"{row[what]:.1%}" for what in ("ringing", "played", "dearest"))
        fits = "yes" if row["dearest"] < 0.25 else "rings only" if row["ringing"] < 0.25 else "NO"
        lines.append(f"| `{name}` | {size} | {cells} | {fits} | {row['build_s']:.2f} |")
    return lines


def refinement() -> list[str]:
    """Lines of the section on what converges with the mesh."""
    found = read("refinement")
    coarse, middle, fine = (f"{rate_Hz / 1e3:g}" for rate_Hz in found["meshes_Hz"])
    lines = [
        "",
        *heading("## Effects on finer meshes", "refinement"),
        f"`drumstick lab refinement`: the same drum and the same stroke in SI on meshes of {coarse}, {middle} and {fine} kHz. The order is log2 of the first change",
        "over the second: 2 means that half the spacing leaves a quarter of the error. Under a force at a point a membrane has no height there, and what hangs",
        "on that height grows with the logarithm of the spacing. Wires that leave the head and fall back on it are chaotic: each stroke is another one",
        "on each mesh, and only what is heard on average comes to the same.",
        "",
        f"| effect | what | change from {coarse} to {middle} kHz | from {middle} to {fine} kHz | order |",
        "|---|---|---|---|---|",
    ]
    for row in found["rows"]:
        changes = (f"{change:.2g} dB" if row["unit"] else f"{change:.2g}" for change in row["changes"])
        order = f"{row['order']:.1f}" if row["order"] > CONVERGES else "does not converge"
        lines.append(f"| `{row['effect']}` | {row['what']} | {' | '.join(changes)} | {order} |")
    return lines
