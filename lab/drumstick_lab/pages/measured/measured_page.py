"""Writes docs/measured.md from the stored results: drumstick lab measured-page."""

from typing import Any

from drumstick_lab.checkout import DOCS
from drumstick_lab.measuring.provenance import heading, usual_machine
from drumstick_lab.measuring.stored import read
from drumstick_lab.pages.measured import measured_drums, measured_panel, measured_robustness, measured_scenes
from haptic_server.servo.force import velocity

PAGE = DOCS / "measured.md"
CEILING_PICTURE = DOCS / "images" / "wire-ceiling.png"

_NAMES = {
    "python": "starting Python itself (baseline)",
    "imports": "Python with numba and zenoh imported (baseline)",
    "help": "`drumstick --help`",
    "back: sound": "sound server killed, until a strike sounds again",
    "back: panel": "panel killed, until it accepts browsers again",
    "back: gateway": "gateway killed, until its state is heard again",
    "back: servo": "servo killed, until it strikes again",
}


def _streamed() -> list[str]:
    result = read("streamed_force")
    lines = [
        "",
        *heading("## A streamed force", "streamed_force"),
        "`drumstick lab streamed-force`, a blow of `roll` beside the analytic one.",
        "",
        "| servo Hz | error of the sound below 1/4 of the servo's rate | below 1/2 | largest sample, relative to the force's peak |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| {rate} | {row['error_below_a_quarter']:.2%} | {row['error_below_half']:.2%} | {row['peak_of_samples']:+.2%} |"
        for rate, row in result["truth"].items()
    ]
    lines += ["", "| what | CPU time |", "|---|---|"]
    lines += [
        f"| {name} | {value:.0f} {unit} |"
        for (name, unit), value in ((what.rsplit(", ", 1), value) for what, value in result["cost"].items())
    ]
    return lines


def _streamed_wire() -> list[str]:
    found = read("streamed_wire")
    lines = [
        "",
        *heading("### On the wire", "streamed_wire"),
        f"`drumstick lab streamed-wire`: a whole rig plays `{found['scene']}`, {found['speed']:g} times as often, {found['contacts']} contacts on loopback:",
        f"{found['broken']} did not come whole. The sound server, at the scene's own delay, bridged {found['bridged']} gaps and left out {found['late']} pieces that came too late.",
        "A message is as old as the end of the newest tick in it; from the beginning of a contact's first tick it is a tick or two more, which the sound's",
        "delay (8.7 ms at 128 frames, or the scene's latency) has to cover. The tail is the machine's: what else ran on it is in these figures.",
        "",
        "| ms | p1 | p50 | p99 | latest |",
        "|---|---|---|---|---|",
    ]
    words = {"message": "a message", "first_tick": "a contact's first tick"}
    kinds = {"measured": "", "less_stalls": ", less what witnesses saw the machine stand still"}
    for name, what in words.items():
        for kind, less in kinds.items():
            row = found["latency"][name][kind]
            cells = " | ".join(f"{row[f'{column}_ms']:.2f}" for column in ("p1", "p50", "p99", "worst"))
            lines.append(f"| {what}{less} | {cells} |")
    return lines


def _mallet() -> list[str]:
    result = read("mallet")
    lines = [
        "",
        *heading("## A mallet", "mallet"),
        "`drumstick lab mallet`: a step of a ringing head that strikes excite, that mallets excite while none plays, and while one is pressed in,",
        f"which has a kilogram; medians of {result['runs']} runs. What the touch adds is the median of each run's own difference, so it is not the difference of"
        " the two columns.",
        "`tom` has a glide, which has to agree with each push; on modes every touch reads and drives all of them.",
        "",
        "| head, tip | step without mallets, ns | while none plays | while it touches | the touch adds |",
        "|---|---|---|---|---|",
    ]
    steps = result["step_ns"]
    for case, touch in result["touch_ns"].items():
        name, tip = case.split(", ")
        without, idle, touching = (
            steps[f"{name}, {words}"] for words in ("strikes", "no mallet plays", f"{tip} touches")
        )
        lines.append(f"| {case} | {without:.0f} | {idle:.0f} | {touching:.0f} | {touch:.0f} |")
    shares = ", ".join(f"`{name}` {share:.0%}" for name, share in result["share_of_a_core"].items())
    lines += [
        "",
        f"{result['strikes_per_s']} strikes a second all over the head take, with the head, so much of a core: {shares}. Two strokes of a roll on `tom` at",
        f"the same speed, 43 ms apart: the correlation of their first 30 ms is {result['correlation_of_two_strokes']:.3f}.",
    ]
    return lines


def _announced() -> list[str]:
    found = read("announced")
    lines = [
        "",
        *heading("## What a strike announces", "announced"),
        "A strike tells peak force, impulse and time in the head of the contact that begins, which the exact solver plays to its end in advance. Beside what",
        "the contact then was: median, and the worst. Before 2026-11-24 it announced those of an isolated blow. `drumstick lab announced`.",
        "An arm's strike is foreseen from what its encoders tell: how fast it comes, and, from its motion and the forces rendered before, where the hand",
        "holds it and how fast that hand moves (services/haptic_server/servo/force/hand_estimate.py). Where the hand goes during the contact nobody can know: it is",
        "taken to go on for 5 ms. In the row \"the hand's way given\" the prediction gets the hand's true motion; what error remains is from the encoder's resolution and sampling.",
        "",
        "| | contacts | peak, dB | impulse, dB | time, % | isolated blow: peak, dB | impulse, dB | time, % | one prediction, us |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for row in (*found["stick"], *found["arm"]):
        cells = [
            f"{median + 0.0:.2f}, {worst + 0.0:.2f}".replace("-0.00", "0.00")
            for which in ("announced", "alone")
            for median, worst in (row[f"{which}_{field}"] for field in ("peak_N", "impulse_N_s", "contact_s"))
        ]
        lines.append(
            f"| {row['name']} | {row['contacts']} | {' | '.join(cells)} | {row.get('look_us', ''):.3} |"
        )
    dearest = ", ".join(f"{name} {cost:.0f} us" for name, cost in found["dearest_us"].items())
    return [
        *lines,
        "",
        f"One prediction is CPU time in the tick that sees a strike. The dearest, of sticks that are pressed down: {dearest}.",
    ]


def _ticks() -> list[str]:
    found = read("tick_cost")
    lines = [
        "",
        *heading("## What a tick of the force loop costs", "tick_cost"),
        "`drumstick lab tick-cost`: everything but the sleep.",
        "",
        "| servo | ns a tick | ratio to a minimal tick of the same scene | ratio to one clock read |",
        "|---|---|---|---|",
    ]
    for name, row in found["rows"].items():
        to_bare, to_clock = row["ratio_to_bare"], row["ratio_to_clock_read"]
        lines.append(f"| {name} | {row['ns']:.0f} | {to_bare:.2f} | {to_clock:.1f} |")
    return [
        *lines,
        "",
        f"At rest the window of an arm's speed is longest, up to {velocity.LONGEST - 1} ticks: each length up to there is tried, against all positions in it.",
    ]


def _lateness() -> list[str]:
    found = read("lateness")
    lines = [
        "",
        *heading("## How late the force loop is", "lateness"),
        f"`drumstick lab lateness`: the servo beside an equal loop in C at the same time, {found['rate_Hz']} Hz,",
        f"{found['windows']} windows of {found['window_s']:g} s each. What witnesses saw the host stall is discounted from both; the first row,"
        " two loops in C,",
        "is the noise of it.",
        "",
        "| condition | p50 us | p99 us | p99.9 us | p99.99 us | C: p99.99 us | p50, relative to C | p99, relative to C | host's longest stall, ms |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, row in found["rows"].items():
        us, c = row["ours"]["discounted"], row["c"]["discounted"]
        cells = " | ".join(f"{us[key]:.0f}" for key in ("p50_us", "p99_us", "p99.9_us", "p99.99_us"))
        lines.append(
            f"| {name} | {cells} | {c['p99.99_us']:.0f} | {row['ratio']['p50']:.2f} | {row['ratio']['p99']:.2f} |"
            f" {row['longest_host_stall_us'] / 1e3:.1f} |"
        )
    lines += [
        "",
        "Where p99.99 is above the 300 us that the loop is meant to keep, so is that of the loop in C beside it: this host delays",
        "wake-ups in ways that its own real-time witnesses see only in part. `drumstick servo-test` says what a machine is fit for.",
    ]
    return lines


def _wire() -> list[str]:
    found, fuzz = read("wire"), read("osc_fuzz")
    lines = [
        "",
        *heading("## What the wire adds", "wire"),
        "`drumstick lab wire`: from the tick that saw the contact to a listener in another process, less what witnesses saw the host",
        "stall; a bare datagram, sent by the striking process itself at the same tick, is the baseline.",
        "",
        "| strikes | bare datagram p50, p99 us | OSC p50, p99 us | above bare | Zenoh p50, p99 us | above bare | lost |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, words in (("latency", "1 kHz for a minute"), ("roll", "25 Hz")):
        row = found[name]
        cells = {k: f"{row[k]['p50_us']:.0f}, {row[k]['p99_us']:.0f}" for k in ("bare", "osc", "zenoh")}
        lost = sum(row[kind]["lost"] for kind in ("osc", "zenoh"))
        lines.append(
            f"| {words} | {cells['bare']} | {cells['osc']} | {row['osc_above_bare_p50_us']:.0f} | {cells['zenoh']} |"
            f" {row['zenoh_above_bare_p50_us']:.0f} | {lost} of {row['strikes']} |"
        )
    back = found["router_returns"]
    lines += [
        "",
        f"A router of its own, killed and its process started again (Python and all): telemetry is back {back['median_s']:.2f} s later, at worst {back['worst_s']:.2f} s"
        f" ({back['runs']} times).",
        "",
        "The ceiling, each rate for three seconds: what share of the strikes did not arrive, and how long half of them took.",
        "",
        "| subscribers | strikes a second | lost over Zenoh | lost over OSC | p50 ms |",
        "|---|---|---|---|---|",
    ]
    for subscribers, rows in found["ceiling"].items():
        lines += [
            f"| {subscribers} | {row['rate_Hz']} | {row['lost_share']:.2%} | {row['lost_osc_share']:.2%} |"
            f" {row['p50_us'] / 1e3:.1f} |"
            for row in rows
        ]
    rig = fuzz["rig"]
    lines += [
        "",
        "![Half of the strikes took so long, over strikes a second, for 1, 10 and 50 subscribers](images/wire-ceiling.png)",
        "",
        "What the gateway cannot carry at once waits in the block's ring, 16,384 events; what finds that full is dropped and counted",
        "(`ring_dropped` of the state). Zenoh drops for a subscriber whose transport is full, OSC what a socket's buffer does not take",
        "(`send_full` in `doctor`): nobody who is slow holds anybody else up, and nothing ever holds the force loop up.",
        "",
        *heading("## Broken OSC messages", "osc_fuzz"),
        f"`drumstick lab osc-fuzz`: {rig['messages']:,} mutants, {rig['messages_per_s']:,} a second, against a playing rig.",
        "",
        f"{rig['unanswered']} of {rig['pings']:,} pings between them stayed without an answer; the longest wait for one was"
        f" {rig['wait_worst_ms']:.0f} ms, half took less than {rig['wait_p50_ms']:.1f} ms, a hundredth more than {rig['wait_p99_ms']:.1f} ms.",
        f"The gateway's memory went from {rig['resident_MB'][1]:.0f} to {rig['resident_MB'][-1]:.0f} MB, the log got"
        f" {rig['lines_in_the_log']} lines, {rig['restarts']} processes were restarted.",
    ]
    for key, words in (("scsynth", "the same messages"), ("scsynth_mutants_only", "the mutants alone")):
        if fuzz[key] is not None:
            lines.append(f"SuperCollider's server 3.13, given {words}, {_borne(fuzz[key])}.")
    return lines


def _borne(found: dict[str, Any]) -> str:
    # How many messages it took, and how it ended, as `drumstick lab osc-fuzz` writes that.
    after = f"after {found['bore']:,} of them" if found["bore"] else "at the very first"
    if found["then"] == "answers no more (TimeoutError)":
        return f"stopped answering {after} (waiting for its answer timed out)"
    return f"{after}: {found['then']}"


def _door() -> list[str]:
    found = read("door")
    lines = [
        "",
        *heading("## The public listener", "door"),
        f"`drumstick lab door`: from a put to a callback, both in one Python process, {found['messages']:,} messages; over loopback TCP, and over",
        "TLS through the door with the certificate of a listener.",
        "",
        "| | loopback p50, p99 us | through the door p50, p99 us | lost |",
        "|---|---|---|---|",
    ]
    for name, row in found["rows"].items():
        cells = [f"{row[way]['p50_us']:.0f}, {row[way]['p99_us']:.0f}" for way in ("loopback", "door")]
        lines.append(f"| {name} | {' | '.join(cells)} | {sum(row[way]['lost'] for way in row)} |")
    return [
        *lines,
        "",
        f"Of {found['knocked']} handshakes that failed, Zenoh told of {found['refused_and_counted']}: ten a second at most.",
    ]


def page() -> str:
    """The whole page."""
    starts, sound = read("start_and_restart"), read("sound_cost")
    lines = [
        "# What was measured",
        "",
        "Made by `drumstick lab measured-page` from `lab/results/`; do not edit. `drumstick lab measure --all` measures all of it anew, but for what takes",
        "hours. The machines were shared and noisy: trust the ratios. Under each heading stands when it was measured, of which version of the code, and what of",
        "the machine is another than that of most figures. Bold: beware of comparing; it is from another machine, or the code has changed since.",
        "",
        "## The machine of most figures",
        "",
        f"{usual_machine()}.",
        "",
        *heading("## Starting, and coming back", "start_and_restart"),
        "`drumstick lab start-and-restart`.",
        "",
        "| what | median s | worst s | multiple of starting Python | multiple of importing numba and zenoh |",
        "|---|---|---|---|---|",
    ]
    lines += [
        f"| {_NAMES[name]} | {row['median']:.2f} | {row['max']:.2f} | {row['to_python']:.0f} | {row['to_imports']:.1f} |"
        for name, row in starts["rows"].items()
    ]
    lines += [*measured_scenes.first_start(), *measured_scenes.python_face()]
    lines += [
        "",
        *heading("## What the drum's accuracy costs", "sound_cost"),
        f"`drumstick lab sound-cost`, a {sound['f01_Hz']:g} Hz head at {sound['device_rate_Hz']} Hz, the median of {sound['runs']} runs.",
        "All of the rendering counts, with pulses, pickups and the interpolation to the device's rate; what the mesh alone costs, in the fastest of short",
        "windows: [mesh.md](mesh.md).",
        "",
        "| `[mesh] accuracy` | junctions | mesh rate Hz | share of a core | ns of all rendering, per junction and step | time, relative to numpy slices | error of f01, cents |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {name} | {row['junctions']} | {row['mesh_rate_Hz']} | {row['share_of_core']:.1%} |"
        f" {row['ns_per_junction_and_step']:.2f} | {row['ratio_to_numpy_slices']:.2f} | {row['f01_error_cents']:+.2f} |"
        for name, row in sound["rows"].items()
    ]
    return "\n".join(
        [
            *lines,
            *measured_scenes.only_what_is_called_for(),
            *measured_scenes.rate_and_level(),
            *measured_scenes.scene_change(),
            *measured_drums.bank(),
            *measured_drums.shares(),
            *measured_drums.refinement(),
            *_streamed(),
            *_streamed_wire(),
            *_mallet(),
            *measured_drums.recordings(),
            *_announced(),
            *_ticks(),
            *_lateness(),
            *measured_robustness.month(),
            *measured_robustness.soak(),
            *_wire(),
            *measured_robustness.gateway_wait(),
            *measured_robustness.torture(),
            *measured_robustness.suite(),
            *_door(),
            *measured_panel.everything(),
            "",
        ]
    )


def _draw_ceiling() -> None:
    # How long half of the strikes took over how many came, by number of subscribers; open marks: some were lost.
    from matplotlib.figure import Figure

    from rig.figures.style import BLUE, DPI, GREEN, VERMILION, scaled

    figure = Figure(figsize=(7.2, 3.8), dpi=DPI, layout="constrained")
    axes = figure.add_subplot()
    shown = zip(read("wire")["ceiling"].items(), ((BLUE, "o"), (GREEN, "s"), (VERMILION, "D")), strict=True)
    for (subscribers, rows), (colour, mark) in shown:
        rates, waits = [row["rate_Hz"] for row in rows], [row["p50_us"] / 1e3 for row in rows]
        words = f"{subscribers} subscriber{'' if subscribers == '1' else 's'}"
        axes.plot(rates, waits, color=colour, lw=1.2, label=words)
        for row, rate, wait in zip(rows, rates, waits, strict=True):
            lost = max(row["lost_share"], row["lost_osc_share"]) > 0.0
            axes.plot(rate, wait, color=colour, marker=mark, ms=7, lw=0, mfc="white" if lost else colour)
    axes.plot([], [], color="black", marker="o", mfc="white", lw=0, label="some were lost")
    axes.set_xscale("log", base=2)
    axes.set_xticks(found := [1000, 2000, 4000, 8000, 16000], [f"{rate:,}" for rate in found])
    axes.minorticks_off()
    scaled(axes, "y", "log")
    axes.set_xlabel("strikes a second")
    axes.set_ylabel("half of them took longer than, ms")
    axes.legend(loc="lower right")
    figure.savefig(CEILING_PICTURE)


def draw() -> None:
    """The picture."""
    from rig.figures.style import styled

    styled(_draw_ceiling)()


if __name__ == "__main__":
    draw()
    PAGE.write_text(page(), encoding="utf-8")
