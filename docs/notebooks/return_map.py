# %% [markdown]
"""
# The return map, κ, and the sign of equation (7)

For students of haptics or nonlinear dynamics, and for whoever has read Berdahl, Verplank, Smith and Niemeyer,
"A physically intuitive haptic drumstick" (ICMC 2007), and wonders about its equation (7). You should have seen
`first_roll.py`.

The paper gives a formula for the speed v_lc at which a roll settles:

    v_lc = β Δv / (1 - α β)                                                    (7)

Δv is the speed that a pulse adds. β is the share of its speed that the stick keeps in a contact, α the share
that it keeps in the hand until the next one. The paper's text says that the pulse begins at the contact and
pushes up, in +z, away from the drum. Formula and text do not fit together, as you will see: the numbers below
come from the exact motion.
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

import drumstick as ds

# %% [markdown]
"""
## The return map

Throw the stick at many speeds, and plot its upward speed v_E after one contact over that after the contact
before. That is a curve, and it has all of the roll in it: where it crosses the diagonal, the speed repeats. Let
a roll walk on it: from the curve across to the diagonal, and up or down to the curve again.
"""

# %%
scene = ds.scene("roll")


def pairs(scene: ds.Scene, throws: np.ndarray) -> np.ndarray:
    """Speeds after the first and the second contact of each throw that has two."""
    runs = [ds.simulate(scene, 1.0, v0_m_per_s=v).contacts["v_e_m_per_s"][:2] for v in throws]
    return np.array([speeds for speeds in runs if len(speeds) == 2]).T


before, after = pairs(scene, np.linspace(0.06, 1.6, 300))
walk = ds.simulate(scene, 2.0, v0_m_per_s=0.06).contacts["v_e_m_per_s"][:14]

figure, axes = plt.subplots(layout="constrained")
axes.plot(before, after, label="return map")
axes.plot(before, before, color="grey", linewidth=0.8, label="no change")
axes.plot(
    np.repeat(walk, 2)[:-1], np.repeat(walk, 2)[1:], color="tab:orange", linewidth=1.0, label="one roll"
)
axes.set(
    xlabel="v_E, m/s", ylabel="v_E after the next contact, m/s", title="Return map of roll", aspect="equal"
)
axes.legend()
plt.show()

# %% [markdown]
"""
`analyse` finds the crossings. The *multiplier* is the slope there: how much of a small disturbance is left one
contact later. Between -1 and 1 the roll is stable.
"""

# %%
(roll,) = ds.analyse(scene).cycles
near = np.argsort(abs(before - roll.v_e_m_per_s))[:5]
slope = np.polyfit(before[near], after[near], 1)[0]
print(f"settles at {roll.v_e_m_per_s:.3f} m/s, multiplier {roll.multiplier:.2f}, slope {slope:.2f}")
# > settles at 0.628 m/s, multiplier 0.69, slope 0.69

# %% [markdown]
"""
## What a pulse really adds: κ

The formula says v_E = β (|v_in| + Δv): the pulse adds to the speed at which the stick goes *into* the head. The
text says that it pushes *up*. So we measure. Without a hand, a contact leaves β |v_in|; with a small pulse it
leaves

    v_E = β |v_in| + κ Δv

and κ is the share of Δv that arrives. It depends on when the pulse fires, which way it pushes, and how long it
lasts: its time constant τ against the contact's 5.46 ms.
"""

# %%
CASES = {
    "at contact, up (the text)": ("entry", 1),
    "at contact, into the head": ("entry", -1),
    "at the deepest point, up": ("turn", 1),
    "at release, up (scene roll)": ("exit", 1),
}


def contact(trigger: str, sign: int, tau_s: float, dv_m_per_s: float) -> np.void:
    """One blow at 1 m/s on the head of roll, no hand."""
    blow = ds.scene(f"""
        [stick]
        k_hand_N_per_m = 0.0
        r_out_N_s_per_m = 0.0
        release = "paper"
        [effects.pulse]
        trigger = "{trigger}"
        sign = {sign}
        tau_s = {tau_s}
        dv_m_per_s = {dv_m_per_s}
        """)
    return ds.simulate(blow, 1.0, v0_m_per_s=-1.0).contacts[0]


def kappa(trigger: str, sign: int, tau_s: float) -> float:
    small = 1e-4
    with_it, without = (contact(trigger, sign, tau_s, dv)["v_e_m_per_s"] for dv in (small, 0.0))
    return (with_it - without) / small


plain = contact("exit", 1, 0.002, 0.0)
beta, contact_s = plain["v_e_m_per_s"], plain["t_out_s"] - plain["t_in_s"]
print(f"beta {beta:.3f}, contact {1e3 * contact_s:.2f} ms")
# > beta 0.789, contact 5.46 ms
for case, (trigger, sign) in CASES.items():
    quick, slow = kappa(trigger, sign, 1e-5), kappa(trigger, sign, 2e-3)
    print(f"{case:28} kappa {quick:+.2f} at 0.01 ms, {slow:+.2f} at 2 ms")
# > at contact, up (the text)    kappa -0.79 at 0.01 ms, -0.26 at 2 ms
# > at contact, into the head    kappa +0.79 at 0.01 ms, +0.26 at 2 ms
# > at the deepest point, up     kappa +0.01 at 0.01 ms, +0.62 at 2 ms
# > at release, up (scene roll)  kappa +1.00 at 0.01 ms, +1.00 at 2 ms

taus_s = np.geomspace(1e-5, 0.1, 60)
figure, axes = plt.subplots(layout="constrained")
for case, (trigger, sign) in CASES.items():
    axes.semilogx(1e3 * taus_s, [kappa(trigger, sign, tau_s) for tau_s in taus_s], label=case)
axes.axvline(1e3 * contact_s, color="grey", linewidth=0.8, linestyle=":", label="duration of the contact")
axes.axhline(0.0, color="grey", linewidth=0.8)
axes.set(xlabel="time constant τ of the pulse, ms", ylabel="κ", title="Share of Δv that a pulse really adds")
axes.legend(fontsize="small", loc="lower left", bbox_to_anchor=(0.0, 0.54))
plt.show()

# %% [markdown]
"""
Read the first two lines. A quick pulse at contact that pushes *into* the head has κ = β = 0.79: that is formula
(7). The same pulse *up*, as the text has it, has κ = -β: it meets a stick that is still coming down, and takes
away what it was to give. At 2 ms it still costs: κ = -0.26. Only a pulse that lasts about as long as the
contact, or longer, still pushes when the stick is on its way out. At release κ = 1, whatever the length.

So the formula describes a pulse into the head, and the text one away from it. We do not know which of the two
the authors built. With κ both are one formula:

    v_lc = κ Δv / (1 - α β)

## Beside the exact roll

`analyse` gives α, β, equation (7) and the formula with κ for any scene, and the exact cycle beside them.
"""

# %%
STICK = """
[stick]
release = "paper"
[effects.pulse]
trigger = "{}"
sign = {}
tau_s = {}
dv_m_per_s = {}
"""


def rolling(trigger: str, sign: int, tau_s: float, dv_m_per_s: float) -> tuple[ds.Scene, ds.Findings]:
    made = ds.scene(STICK.format(trigger, sign, tau_s, dv_m_per_s))
    return made, ds.analyse(made)


for case in (("entry", -1, 1e-5, 0.2), ("entry", 1, 2e-3, 1.0), ("exit", 1, 2e-3, 0.2)):
    made, found = rolling(*case)
    exact = found.cycles[found.primary]
    print(
        f"{case}: (7) {found.v_lc_eq7_m_per_s:.2f}, with kappa {found.v_lc_kappa_m_per_s:.2f}, "
        f"exact {exact.v_e_m_per_s:.2f} m/s, {exact.rate_Hz:.1f} Hz"
    )
# > ('entry', -1, 1e-05, 0.2): (7) 0.58, with kappa 0.53, exact 0.54 m/s, 25.4 Hz
# > ('entry', 1, 0.002, 1.0): (7) 2.88, with kappa 0.52, exact 0.58 m/s, 26.2 Hz
# > ('exit', 1, 0.002, 0.2): (7) 0.57, with kappa 0.67, exact 0.63 m/s, 23.1 Hz

# %% [markdown]
"""
The first line is formula (7)'s own case, and there it is off by less than a tenth. The rest is β: with a hand
that presses the stick down, a contact leaves less than equation (3) says. The second line is the pulse of the
text, the scene `paper-roll`: formula (7) promises five times the speed that comes. How can it roll at all, with
κ < 0? Because that pulse is stronger than the blow. It throws the stick back before the head is compressed, so
v_E = Δv - |v_in|, and that settles at Δv / (1 + α): the number under "with kappa". The third is the default
scene `roll`, at release; κ = 1.

## A falling map buzzes

For v_E = Δv - |v_in| the map *falls*: a hard blow is followed by a soft one, so the multiplier is negative.
Below -1 the even roll is still there, but no stick stays on it.
"""

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(10.0, 4.5), layout="constrained")
for dv in (0.25, 0.2):
    weaker = ds.scene("paper-roll", dv_pls=dv)
    left.plot(ds.simulate(weaker, 6.0).contacts["v_e_m_per_s"][:30], ".-", label=f"Δv = {dv} m/s")
    once_around = [cycle for cycle in ds.analyse(weaker).cycles if cycle.period == 1]
    print(f"dv_pls {dv}: multiplier of the even roll {once_around[-1].multiplier:.2f}")
# > dv_pls 0.25: multiplier of the even roll -0.82
# > dv_pls 0.2: multiplier of the even roll -1.24
left.set(xlabel="contact", ylabel="v_E, m/s", title="paper-roll: even, and alternating")
left.legend()

pulses = np.linspace(0.15, 0.3, 400)
for dv in pulses:
    run = ds.simulate(ds.scene("paper-roll", dv_pls=dv), 6.0)
    if run.end == "time":
        last = run.contacts["v_e_m_per_s"][-40:]
        right.plot(np.full(len(last), dv), last, ".", markersize=1.5, color="tab:blue")
right.set(
    xlabel="Δv, m/s", ylabel="v_E of the last 40 contacts, m/s", title="Weaker pulses: strokes alternate"
)

for dv in (1.0, 0.2, 0.15):
    run = ds.simulate(ds.scene("paper-roll", dv_pls=dv), 6.0)
    speeds = np.unique(run.contacts["v_e_m_per_s"][-40:].round(3)) if run.end == "time" else "none"
    print(f"dv_pls {dv}: speeds {speeds}, {run.end}")
# > dv_pls 1.0: speeds [0.581], time
# > dv_pls 0.2: speeds [0.052 0.152], time
# > dv_pls 0.15: speeds none, captured
plt.show()

# %% [markdown]
"""
At 1 m/s one speed: an even roll. At 0.2 m/s two strokes alternate, strong and weak; below that the alternation
doubles again, and at 0.15 m/s the stick stays in the head. `docs/stick.md` has the same for every case,
computed to more digits.

**In a word.** Formula (7) is right for a quick pulse into the drum at contact, and promises several times too
much for the pulse that the text describes. If you build one: fire at release.
"""
