"""Figure of a hand that changes its grip while it plays: what it does, and the rate of the roll that follows."""

import numpy as np
from matplotlib.figure import Figure

from drumstick.analysis.cycles.grips import grips_at
from drumstick.parameters.scene import Scene
from drumstick.public.run import simulate
from drumstick.scenes.gesture import stick_gesture
from rig.figures.style import BLUE, DPI, GREEN, GREY, HEIGHT_IN, VERMILION, WIDTH_IN, legend_below, styled

_POINTS = 400


@styled
def grip(scene: Scene) -> Figure:
    """Figure with the rate from strike to strike over one gesture, beside that of each grip held still, over K_hand and
    R_out.
    """
    gesture = stick_gesture(scene, None)
    assert gesture is not None
    length_s = float(gesture[-1, 0])
    begins = simulate(scene, length_s).contacts["t_in_s"]
    times = np.linspace(0.0, length_s, _POINTS, endpoint=False)
    held = grips_at(scene, gesture, times)
    figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN), dpi=DPI, layout="constrained")
    rate, stiffness = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 2.0))
    rate.set_title(f"{scene.name}: the grip moves, the drum's pulse stays as it is")
    still = [np.nan if each.rate_Hz is None else each.rate_Hz for each in held]
    rate.plot(times, still, color=GREY, ls=(0, (5, 2)), label="roll of the grip, if it stayed")
    between = 0.5 * (begins[1:] + begins[:-1])
    rate.plot(between, 1.0 / np.diff(begins), "o", color=BLUE, ms=3, label="from strike to strike")
    rate.set_ylim(0.0, None)
    rate.set_ylabel("rate  (Hz)")
    k_hand, r_out = ([getattr(each, name) for each in held] for name in ("k_hand_N_per_m", "r_out_N_s_per_m"))
    stiffness.plot(times, k_hand, color=VERMILION, label="K_hand")
    stiffness.set_ylim(0.0, None)
    stiffness.set_ylabel("K_hand  (N/m)")
    stiffness.set_xlabel("time  (s)")
    stiffness.set_xlim(0.0, length_s)
    damping = stiffness.twinx()
    damping.plot(times, r_out, color=GREEN, ls="-.", label="R_out")
    damping.set_ylim(0.0, 2.0 * max(r_out))
    damping.set_ylabel("R_out  (N s/m)")
    damping.spines["right"].set_visible(True)
    legend_below(figure, 4)
    return figure
