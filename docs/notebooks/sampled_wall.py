# %% [markdown]
"""
# Why a sampled wall feeds energy, and where the envelope comes from

For students of haptics, and for the technician who was told "refused" and wants to know why. You need some
mechanics: a mass, a spring, a damper.

A motor arm is read at each *tick*, mostly a thousand times a second, and its force is held until the next one.
A spring that such an arm renders gives back more energy than it got. This notebook makes one in a few lines of
NumPy, finds what cures it, and then asks the instrument which heads it accepts.
"""

# %%
import textwrap

import matplotlib.pyplot as plt
import numpy as np

import drumstick as ds

MASS_KG = 0.075  # what the hand feels of the arm, at its tip

# %% [markdown]
"""
## One blow

The arm falls on a head of stiffness K and damping R. The program knows the position at each tick, nothing else:
it takes the speed from the last two positions. The force goes to the motors, perhaps some ticks late, and stays
until the next one comes. Between two ticks the force is constant, so position and speed there are exact: no
numerical error feeds this wall. A head pushes; it never pulls.
"""


# %%
def blow(k, r, tick_s=1e-3, late=0, phase=0.5, lead_s=0.0, speed=0.3):
    """Place, speed and force at each tick, shape (n,), from above the head to above it again."""
    z, v = phase * tick_s * speed, -speed
    before = z - v * tick_s
    waiting, seen = [0.0] * late, []
    for _ in range(2000):
        measured = (z - before) / tick_s
        led = z + lead_s * measured  # where the arm will be, if it goes on like that
        waiting.append(max(-k * led - r * measured, 0.0) if led < 0.0 else 0.0)
        force = waiting.pop(0)
        seen.append((z, v, force))
        if z > 0.0 and v > 0.0 and force == 0.0:
            break
        before = z
        z, v = z + v * tick_s + force / MASS_KG * tick_s**2 / 2, v + force / MASS_KG * tick_s
    return np.array(seen).T


def restitution(k, r, phases=16, **how):
    """Speed after a blow over the speed before it: the mean over where in a tick it falls."""
    return np.mean(
        [blow(k, r, phase=phase, **how)[1][-1] / 0.3 for phase in (np.arange(phases) + 0.5) / phases]
    )


for tick_s in (1e-3, 0.5e-3, 0.25e-3):
    returned = restitution(3500.0, 0.0, tick_s=tick_s)
    print(f"a pure spring of 3500 N/m at {1 / tick_s:.0f} Hz returns {returned:.2f} of the speed")
# > a pure spring of 3500 N/m at 1000 Hz returns 1.18 of the speed
# > a pure spring of 3500 N/m at 2000 Hz returns 1.09 of the speed
# > a pure spring of 3500 N/m at 4000 Hz returns 1.04 of the speed

# %% [markdown]
"""
A real spring returns 1. This one makes the arm faster, and a longer tick makes it worse. Look at the force over
the depth. On the way in the force dates from up to a tick ago, when the spring was less compressed: too small.
On the way out it is too large. The area between the two ways is energy, and it goes to the arm.
"""

# %%
z, v, force = blow(3500.0, 0.0)
figure, (left, right) = plt.subplots(1, 2, figsize=(10.0, 4.2), layout="constrained")
t_ms = np.arange(len(z))
left.step(t_ms, force, where="post", color="tab:red", label="force that is held")
left.plot(t_ms, np.maximum(-3500.0 * z, 0.0), "k.", label="force of the spring at each tick")
left.set(xlabel="time, ms", ylabel="force on the arm, N", title="Held for a tick, so half a tick late")
left.legend()

fine = np.linspace(0.0, 1.0, 50)
depth = np.concatenate(
    [z[i] + v[i] * fine * 1e-3 + force[i] / MASS_KG * (fine * 1e-3) ** 2 / 2 for i in range(len(z) - 1)]
)
held = np.repeat(force[:-1], len(fine))
right.plot(-1e3 * depth, held, color="tab:red")
right.fill(-1e3 * depth, held, color="tab:red", alpha=0.2, label="energy that the arm gains")
right.plot([0.0, -1e3 * z.min()], [0.0, -3500.0 * z.min()], "k", linewidth=0.8, label="a real spring")
right.set(
    xlabel="depth in the head, mm",
    ylabel="force on the arm, N",
    title="Too weak on the way in, too strong on the way out",
)
right.legend(loc="upper left")

gained = np.sum(np.diff(depth) * held[1:])
print(f"gained {1e3 * gained:.2f} mJ of {1e3 * MASS_KG * 0.3**2 / 2:.2f} mJ")
# > gained 1.32 mJ of 3.38 mJ
assert abs(gained - MASS_KG * (v[-1] ** 2 - 0.3**2) / 2) < 1e-4 * gained  # what the speeds say
plt.show()

# %% [markdown]
"""
## What cures it

A force that is late by d is, for slow motion, a spring plus a damper of the wrong sign: K z(t - d) ≈ K z - K d
z'. Holding for a tick T is a mean delay of T/2; the device may add a delay t_d of its own. So the arm feels a
damping of only

    R_eff = R - K (T/2 + t_d)

and equation (3) of the paper says what such a head returns. That is the first rule of the *envelope*, the part
of the program that judges a set of values before it may play: **R must be larger than K (T/2 + t_d)**.
"""


# %%
def equation_3(k, r):
    return np.exp(-np.pi * r / np.sqrt(4 * MASS_KG * k - r**2))


def by_r_eff(k, r, late):
    return equation_3(k, r - k * (0.5e-3 + 1e-3 * late))


print(f"3500 N/m, 2.5 N s/m: a real head {equation_3(3500.0, 2.5):.2f}")
# > 3500 N/m, 2.5 N s/m: a real head 0.78
for late in (0, 1):
    found, expected = restitution(3500.0, 2.5, late=late), by_r_eff(3500.0, 2.5, late)
    print(f"{late} ticks late: {found:.2f}, by R_eff {expected:.2f}")
# > 0 ticks late: 0.95, by R_eff 0.93
# > 1 ticks late: 1.34, by R_eff 1.31

stiffness = np.linspace(200.0, 3500.0, 25)
figure, axes = plt.subplots(layout="constrained")
for late, colour in ((0, "tab:blue"), (1, "tab:orange")):
    found = [restitution(k, 2.5, late=late) for k in stiffness]
    axes.plot(stiffness, found, "o", markersize=4, color=colour, label=f"sampled, {late} ticks late")
    axes.plot(stiffness, by_r_eff(stiffness, 2.5, late), color=colour, label="by R_eff")
    led = [restitution(k, 2.5, late=late, lead_s=0.5e-3 + 1e-3 * late) for k in stiffness]
    axes.plot(stiffness, led, "x", markersize=5, color=colour, label="the same, led")
axes.plot(stiffness, equation_3(stiffness, 2.5), "k", label="a real head")
axes.axhline(1.0, color="grey", linewidth=0.8, linestyle=":")
axes.set(
    xlabel="stiffness K, N/m",
    ylabel="speed after / speed before",
    title="A blow on a sampled head, R = 2.5 N s/m, 1 kHz",
    ylim=(0.3, 1.6),
)
axes.legend(ncols=2, fontsize="small")
plt.show()

# %% [markdown]
"""
Crosses: the program *leads*. It estimates where the arm will be when the force acts (half a tick from now on
average, plus the device's delay), and the head is nearly the real one again. That is why the instrument does
so (`[servo] predictor = "lead"`). But a lead is a guess, so the first rule gives no credit for it.

## Too much damping is no way out

Why not choose a large R and be safe? Because the damper is late too. Let the arm move inside the head with no
spring at all. The damper takes R T/m of the speed in a tick. If that is more than 2, it throws the arm back
faster than it came.
"""


# %%
def speeds_in_the_head(r, ticks=14, tick_s=1e-3):
    v, mean_before, seen = 0.1, 0.1, []
    for _ in range(ticks):
        force = -r * mean_before  # the speed is that of the last two positions
        after = v + force / MASS_KG * tick_s
        mean_before, v = (v + after) / 2, after
        seen.append(v)
    return np.array(seen)


limit = 2 * MASS_KG / 1e-3
print(f"2 m/T = {limit:.0f} N s/m")
# > 2 m/T = 150 N s/m
figure, axes = plt.subplots(layout="constrained")
for r in (40.0, 120.0, 165.0):
    moved = speeds_in_the_head(r)
    axes.plot(moved, "o-", markersize=4, label=f"R = {r:.0f} N s/m")
    print(f"R = {r:.0f} N s/m: {'calms down' if abs(moved[-4:]).max() < abs(moved[:4]).max() else 'grows'}")
# > R = 40 N s/m: calms down
# > R = 120 N s/m: calms down
# > R = 165 N s/m: grows
axes.set(xlabel="tick", ylabel="speed, m/s", title="An arm inside a damper that is read at ticks")
axes.legend()
plt.show()

# %% [markdown]
"""
## Ask the instrument

`ds.servo` judges a scene as the live program does and raises `ds.OutOfEnvelope` with the reason. We ask for
many heads, on the simulated arm, and colour the answers.
"""

# %%
HEAD = """
[stick]
m_kg = 0.075
k_coll_N_per_m = {k}
r_in_N_s_per_m = {r}
k_hand_N_per_m = 60.0
r_out_N_s_per_m = 0.5
z_ss_m = -0.01
[hand]
throw_m_per_s = 0.05
[device]
plant = "phantom"
delay_ticks = {late}
"""


def judged(k: float, r: float, late: int) -> str:
    try:
        ds.servo(ds.scene(HEAD.format(k=k, r=r, late=late)), duration_s=0.001)
    except ds.OutOfEnvelope as refusal:
        return str(refusal).partition("envelope: ")[2]
    return "accepted"


print(textwrap.fill(judged(3000.0, 1.0, 0), 100))
# > the force comes 0.5 ms late on average; that delay takes k_coll times as much from the damping r_in:
# > raise r_in, lower k_coll or raise [servo] rate_Hz
print(textwrap.fill(judged(3000.0, 30.0, 0), 100))
# > r_in = 30 N s/m could keep an arm of 0.0638 .. 0.09 kg in a limit cycle of encoder counts of 0.03
# > mm: lower r_in to 6.81 N s/m
print(textwrap.fill(judged(4000.0, 3.0, 0), 100))
# > k_coll = 4000 N/m is stiffer than this device can render, 3500 N/m: lower k_coll

# %%
REASONS = (  # words of the refusal, what we call it, colour
    ("accepted", "accepted", "tab:green"),
    ("the force comes", "R below K (T/2 + t_d)", "tab:red"),
    ("moving by itself", "would not come to rest", "tab:orange"),
    ("limit cycle", "sensor steps would be felt", "tab:purple"),
    ("stiffer", "stiffer than the motors", "tab:gray"),
)
figure, axes = plt.subplots(1, 2, figsize=(10.0, 5.0), sharey=True, layout="constrained")
for panel, late in zip(axes, (0, 1), strict=True):
    heads = [(k, r) for k in np.linspace(200.0, 4000.0, 36) for r in np.geomspace(0.6, 200.0, 46)]
    answers = [judged(k, r, late) for k, r in heads]
    for words, label, colour in REASONS:
        kept = np.array([head for head, answer in zip(heads, answers, strict=True) if words in answer])
        panel.plot(*kept.T, "s", markersize=5, color=colour, label=label)
    k = np.linspace(200.0, 3500.0, 50)
    panel.plot(k, k * (0.5e-3 + 1e-3 * late), "k", label="R = K (T/2 + t_d)")
    panel.axhline(limit, color="k", linestyle="--", label="R = 2 m/T")
    panel.set(yscale="log", ylim=(0.5, 250.0), xlabel="stiffness K, N/m", title=f"{late} ticks late")
    accepted = sum(answer == "accepted" for answer in answers) / len(answers)
    print(f"{late} ticks late: {accepted:.0%} accepted")
# > 0 ticks late: 30% accepted
# > 1 ticks late: 11% accepted
axes[0].set_ylabel("damping R, N s/m")
figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize="small")
plt.show()

# %% [markdown]
"""
The two simple lines are the walls of a valley: nothing below the first, nothing near the second; long before it
the steps of the position sensor set the limit. The green region is smaller than the valley. The instrument also
judges a lighter and a heavier arm, with and without a hand, and follows whole blows at several moments of a
tick. A device that is one tick late can hardly have a stiff head: lateness, more than weak motors, is what
makes a wall soft.

Behind the envelope stands a *guard*. It looks at each tick, whatever was accepted, and takes away the energy
that the head would give beyond what it got. `docs/servo.md` has the rules with their derivation, and
`docs/safety.md` says what none of this protects from. Nothing here was tried on a real arm.
"""
