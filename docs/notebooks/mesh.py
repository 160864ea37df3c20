# %% [markdown]
"""
# The mesh, its tuning, and what accuracy costs

For students of physical modelling, and for musicians who ask why a finer mesh sounds brighter and costs so
much. You should know what a mode and a cent are (100 cents are a semitone).

The head of the drum is computed as a mesh: junctions side by side, each of which looks at its neighbours once
in a step. A real head has its modes at the zeros of Bessel functions. Where does the mesh have them? We do not
look into the program: we strike the drum and measure what we hear.
"""

# %%
import time

import matplotlib.pyplot as plt
import numpy as np
from scipy.special import jn_zeros

import drumstick as ds

F01_HZ = 150.0

# %% [markdown]
"""
## What the head should have

The mode with m nodal diameters and n nodal circles is at the n-th zero of the Bessel function J_m; (0,1) is the
lowest. Some lie so close together that no ear and no spectrum tells them apart: those with a neighbour nearer
than a fifth of a semitone are left out.
"""

# %%
zeros = np.sort([zero for m in range(12) for zero in jn_zeros(m, 5)])
all_Hz = (F01_HZ * zeros / zeros[0])[:25]
apart = np.diff(np.log(all_Hz), prepend=0.0) > 0.012  # a fifth of a semitone
lone_Hz = all_Hz[apart & np.roll(apart, -1)]
lone_Hz = lone_Hz[lone_Hz < 800.0]
print(f"{len(lone_Hz)} lone modes, {lone_Hz[0]:.0f} to {lone_Hz[-1]:.0f} Hz")
# > 15 lone modes, 150 to 735 Hz
print(f"the second is {lone_Hz[1] / F01_HZ:.3f} times the first")
# > the second is 1.593 times the first

# %% [markdown]
"""
## Strike and measure

A drum that rings for 20 s has narrow peaks. The blow and the pickups stand where no low mode has a node. A
parabola through the three highest points of a peak tells its place far better than the steps of the spectrum
do.
"""

# %%
DRUM = """
[drum]
f01_Hz = 150.0
t60_s = 20.0
inject = "linear"
[listen]
pickups = [[0.71, 0.33, -1.0], [-0.23, 0.52, 1.0]]
"""


def spectrum(mesh: str) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and levels of one stroke's ringing."""
    sound = ds.render(ds.scene(DRUM + mesh), ds.strike(1.0, x=0.62, y=0.21), duration_s=6.0)
    ringing = np.asarray(sound, float)[round(0.05 * sound.rate_Hz) :]
    levels = np.abs(np.fft.rfft(ringing * np.hanning(len(ringing))[:, np.newaxis], axis=0)).sum(axis=1)
    return np.fft.rfftfreq(len(ringing), 1.0 / sound.rate_Hz), levels


def cents_off(mesh: str) -> np.ndarray:
    """Pitch of each lone mode, in cents above where it should be."""
    f_Hz, levels = spectrum(mesh)
    found = []
    for ideal in lone_Hz:
        around = np.flatnonzero((f_Hz > 0.99 * ideal) & (f_Hz < 1.005 * ideal))
        top = around[np.argmax(levels[around])]
        left, middle, right = np.log(levels[top - 1 : top + 2])
        found.append(f_Hz[top] + (left - right) / (left - 2 * middle + right) / 2 * f_Hz[1])
    return 1200.0 * np.log2(np.array(found) / lone_Hz)


f_Hz, levels = spectrum("[mesh]\nrate_Hz = 24000.0")
figure, axes = plt.subplots(layout="constrained")
axes.plot(f_Hz, 20 * np.log10(levels / levels.max()), linewidth=0.7)
axes.vlines(lone_Hz, 3.0, 10.0, color="tab:red", label="modes of an ideal head")
axes.set(
    xlim=(100.0, 800.0),
    ylim=(-90.0, 12.0),
    xlabel="frequency, Hz",
    ylabel="level, dB",
    title="One stroke on a mesh",
)
axes.legend(loc="lower left")
plt.show()

# %% [markdown]
"""
## Flat on top

On a mesh short waves travel too slowly (numerical dispersion), so high modes are flat (too low). The lowest
mode is in tune on every mesh: the program chooses the distance between junctions so that it is. That is all of
its tuning. The names below give a mesh's steps a second; `fine` uses a formula of the fourth order;
`rectilinear` has four neighbours instead of six.
"""

# %%
MESHES = {
    "6 kHz": "[mesh]\nrate_Hz = 6000.0",
    "12 kHz": "[mesh]\nrate_Hz = 12000.0",
    "24 kHz": "[mesh]\nrate_Hz = 24000.0",
    "6 kHz, fine": '[mesh]\naccuracy = "fine"\nrate_Hz = 6000.0',
    "12 kHz, fine": '[mesh]\naccuracy = "fine"\nrate_Hz = 12000.0',
    "12 kHz, four neighbours": '[mesh]\ntopology = "rectilinear"\nrate_Hz = 12000.0',
    "bank of modes": "[modal]\ntop_Hz = 2000.0",
}
errors = {name: cents_off(mesh) for name, mesh in MESHES.items()}
for name, cents in errors.items():
    print(f"{name:24} lowest {abs(cents[0]):.1f} cents, worst {abs(cents).max():.1f} cents")
# > 6 kHz                    lowest 0.0 cents, worst 9.4 cents
# > 12 kHz                   lowest 0.0 cents, worst 1.8 cents
# > 24 kHz                   lowest 0.0 cents, worst 0.4 cents
# > 6 kHz, fine              lowest 0.0 cents, worst 4.4 cents
# > 12 kHz, fine             lowest 0.0 cents, worst 0.5 cents
# > 12 kHz, four neighbours  lowest 0.0 cents, worst 8.7 cents
# > bank of modes            lowest 0.0 cents, worst 0.0 cents

figure, axes = plt.subplots(layout="constrained")
for (name, cents), marker in zip(errors.items(), "os^ov*x", strict=True):
    axes.plot(lone_Hz, cents, marker=marker, markersize=4, linewidth=1.0, label=name)
axes.set(
    xlabel="frequency of the mode, Hz",
    ylabel="heard pitch above the ideal, cents",
    title="Modes of a mesh, and of a bank of modes",
)
axes.legend(fontsize="small")
plt.show()

# %% [markdown]
"""
Twice the rate leaves about a fifth of the error. `fine` leaves half of it at 6 kHz and a quarter at 12 kHz,
where it is about as good as the usual formula at 24 kHz. Six neighbours beat four by far: on their mesh waves
run nearly equally fast in every direction. A *bank of modes* has no mesh: each mode is computed by itself,
exactly.

Is it heard? In a single stroke hardly. It counts for a drum that is tuned to other instruments, and for a
bright one: far above 800 Hz every mesh is flatter than here.

## What it costs

Twice the rate means half the distance between junctions: four times as many, twice as often. So the work grows
eightfold, once the mesh is large enough that nothing else counts. We measure processor time, not time by the
clock, and take the least of several: other programs only ever add.
"""


# %%
def seconds_of_work(mesh: str, duration_s: float) -> float:
    scene, least = ds.scene(DRUM + mesh), np.inf
    for _ in range(3):
        begun = time.process_time()
        ds.render(scene, ds.strike(1.0), duration_s=duration_s)
        least = min(least, time.process_time() - begun)
    return least


def cost(mesh: str) -> float:
    """Share of a core that the drum takes while it plays; what is made once at the start cancels."""
    return (seconds_of_work(mesh, 9.0) - seconds_of_work(mesh, 1.0)) / 8.0


RATES_HZ = (6000, 8000, 12000, 16000, 24000)
figure, axes = plt.subplots(layout="constrained")
for accuracy, marker, place in (("standard", "o", (5, 4)), ("fine", "s", (-30, -10))):
    meshes = [f'[mesh]\naccuracy = "{accuracy}"\nrate_Hz = {rate_Hz}.0' for rate_Hz in RATES_HZ]
    costs = [cost(mesh) for mesh in meshes]
    worst = [abs(cents_off(mesh)).max() for mesh in meshes]
    axes.loglog(100 * np.array(costs), worst, marker=marker, label=accuracy)
    for share, cents, rate_Hz in zip(costs, worst, RATES_HZ, strict=True):
        point = (100 * share, cents)
        axes.annotate(f"{rate_Hz // 1000} kHz", point, place, textcoords="offset points", fontsize="small")
    growth = costs[-1] / costs[0]
    print(f"{accuracy}: {growth:.0f} times the cost, {worst[0]:.1f} to {worst[-1]:.1f} cents")
# > standard: ... times the cost, 9.4 to 0.4 cents
# > fine: ... times the cost, 4.4 to 0.1 cents
axes.set(
    xlabel="cost, % of a core",
    ylabel="worst error of the lone modes, cents",
    title="What accuracy costs on this machine, 6 to 24 kHz",
)
axes.margins(x=0.15)
axes.legend()
plt.show()

# %% [markdown]
"""
The costs are your machine's: that is why dots stand for them above. Take the curve that lies further to the
left at the error that you can bear. The panel of the instrument and `drumstick accuracy` show the same for your
machine, with all of the first twenty modes, and `docs/accuracy-and-time.md` has a table "if you want ... choose
...". `accuracy = "auto"` in a scene chooses for you.

Not only accuracy costs. An effect that the scene does not name is not computed at all; what each costs is in
that table, too.
"""
