# %% [markdown]
"""
# A first roll in ten minutes

For students and musicians who know a little Python. At the end you have thrown a stick, seen it roll, made the
roll faster and slower, heard the drum, and played the same roll on a simulated motor arm.

Run one cell after the other (Shift+Enter). Lines that begin with `# >` show what a cell prints; dots stand for
what differs from run to run. The first time that something is computed its code is compiled: up to a minute,
once on each machine.

You need the environment that `make install` makes, or `pip install '.[sound,figures]'` in the project's folder.
No rig has to run, and no device is needed.
"""

# %%
import dataclasses
import math

import matplotlib.pyplot as plt
import numpy as np

import drumstick as ds

# %% [markdown]
"""
## Throw a stick

A *scene* describes a stick, a hand, a drum and what is done to the stick. `roll` is the one that the instrument
starts with: a hand holds a stick like a soft spring, and each time the stick leaves the head, a short pulse
throws it up again.

`simulate` throws it and plays. Nothing is stepped in time: between two contacts the motion is a formula, and
the program looks for the next instant at which something happens.
"""

# %%
scene = ds.scene("roll")
run = ds.simulate(scene, duration_s=10)
print(run)
# > Run(roll: 231 contacts in 10 s, 23.1 Hz)

# %% [markdown]
"""
That is 23 strokes a second, with one hand. Let us look at the first half second. Height 0 is the head. The
force is the one that the head pushes back with; at the end of a contact it is a little below 0, because in the
paper's model the head's damper may pull.
"""

# %%
t_s = np.linspace(0.0, 0.5, 4001)
height_m, speed_m_per_s, force_N = run.motion(t_s)

figure, (above, below) = plt.subplots(2, 1, sharex=True, layout="constrained")
above.plot(t_s, 1e3 * height_m)
above.axhline(0.0, color="grey", linewidth=0.8)
above.set(ylabel="height of the tip, mm", title="The stick rises, falls, and is thrown up again")
below.plot(t_s, force_N, color="tab:red")
below.set(ylabel="force of the head, N", xlabel="time, s")
plt.show()

# %% [markdown]
"""
## One row for each contact

`run.contacts` is a NumPy array with named columns; each name ends in its unit. `v_in` is negative because the
stick comes from above. `v_e` is its upward speed after a contact, and includes what the pulse has still to add.
"""

# %%
print(run.contacts.dtype.names[:5])
# > ('t_in_s', 'v_in_m_per_s', 't_out_s', 'v_out_m_per_s', 'v_e_m_per_s')
for contact in run.contacts[[0, 1, 2, 20]]:
    print(f"{contact['v_in_m_per_s']:.3f} m/s in, {contact['v_e_m_per_s']:.3f} m/s after it")
# > -0.376 m/s in, 0.483 m/s after it
# > -0.429 m/s in, 0.525 m/s after it
# > -0.467 m/s in, 0.555 m/s after it
# > -0.558 m/s in, 0.628 m/s after it

# %% [markdown]
"""
The throw was at 0.4 m/s, but the roll settles at 0.628 m/s, whatever you throw. That is a *limit cycle*: strong
strokes lose more than the pulse gives, weak ones lose less.
"""

# %%
figure, axes = plt.subplots(layout="constrained")
for thrown in (0.1, 0.2, 0.4, 0.8, 1.6):
    speeds = ds.simulate(scene, duration_s=2, v0_m_per_s=thrown).contacts["v_e_m_per_s"][:16]
    axes.plot([thrown, *speeds], "o-", markersize=4, label=f"{thrown} m/s")
    assert math.isclose(speeds[-1], 0.628, abs_tol=0.01)
axes.set(
    xlabel="contact (0 is the throw)",
    ylabel="upward speed after it, m/s",
    title="Every throw ends in one roll",
)
axes.legend(title="thrown at")
plt.show()

# %% [markdown]
"""
But a throw that is too weak does not. The hand presses the stick down, and a stick that does not come out of
the head again meets no pulse. The roll is *captured*:
"""

# %%
print(ds.simulate(scene, duration_s=2, v0_m_per_s=0.05))
# > Run(roll: 0 contacts in 2 s, captured at 0.01857 s)

# %% [markdown]
"""
## Turn the knobs

These are the values that can be changed while the instrument plays, under the names that the page, OSC and
Zenoh use. `dv_pls` is the speed that one pulse adds (m/s), `k_hand` how stiff the hand holds (N/m), `r_in` how
much the head damps (N s/m).
"""

# %%
values = ds.values(scene)
print({name: values[name] for name in ("dv_pls", "k_hand", "r_in")})
# > {'dv_pls': 0.2, 'k_hand': 20.0, 'r_in': 1.3}
print(*values)
# > m k_coll r_in k_hand r_out z_ss dv_pls tau z_h0 drum.f01 drum.t60 listen.gain listen.pan listen.mute

# %%
pulses = np.linspace(0.08, 0.5, 40)
grips = (10.0, 20.0, 40.0)
figure, axes = plt.subplots(layout="constrained")
for grip in grips:
    runs = [ds.simulate(ds.scene("roll", dv_pls=dv, k_hand=grip), 10.0) for dv in pulses]
    rates = [run.rate_Hz if run.end == "time" else math.nan for run in runs]  # some are captured
    axes.plot(pulses, rates, label=f"{grip:.0f} N/m")
axes.set(
    xlabel="dv_pls, m/s",
    ylabel="strokes a second",
    title="A stronger pulse: louder, slower. A firmer hand: faster",
)
axes.legend(title="k_hand")

for dv in (0.1, 0.2, 0.4):
    print(f"dv_pls {dv}: {ds.simulate(ds.scene('roll', dv_pls=dv), 10.0).rate_Hz:.1f} Hz")
# > dv_pls 0.1: 38.6 Hz
# > dv_pls 0.2: 23.1 Hz
# > dv_pls 0.4: 16.6 Hz
plt.show()

# %% [markdown]
"""
## Listen

`render` gives the drum's sound as an array of samples, computed by the code that plays on stage. In a notebook
the cell below shows a player. In a script, write `sound.wav()` into a file.
"""

# %%
sound = ds.render(scene, ds.simulate(scene, duration_s=2))
print(sound.shape, sound.rate_Hz)
# > (189944, 2) 48000
sound

# %% [markdown]
"""
## The same on a motor arm

An arm is read a thousand times a second and holds its force in between. `servo` plays a scene by the same
program step (a *tick*) that drives a real arm, here a simulated one. `phantom` is the roll for a PHANTOM, whose
motors give at most 8.5 N; its hinges rub a little. With a loose hand and a smaller pulse, friction decides.
"""

# %%
phantom = ds.scene("phantom")
print(f"at most {phantom.guard.max_force_N} N, friction {phantom.device.friction_N} N")
# > at most 8.5 N, friction 0.04 N
loose = ds.scene("phantom", k_coll=3500.0, r_in=2.5, k_hand=60.0, r_out=0.5, z_ss=-0.01, dv_pls=0.06)


def on_an_arm(scene: ds.Scene, friction_N: float) -> ds.ServoRun:
    device = dataclasses.replace(scene.device, friction_N=friction_N)
    return ds.servo(dataclasses.replace(scene, device=device), duration_s=3.0)


figure, (firm_axes, loose_axes) = plt.subplots(1, 2, sharey=True, layout="constrained")
for name, scene, axes in (("firm hand", phantom, firm_axes), ("loose hand", loose, loose_axes)):
    for roll in ds.analyse(scene).cycles:
        axes.axhline(-roll.v_in_m_per_s, color="grey", linestyle="--" if roll.stable else ":")
        kind = "a roll" if roll.stable else "an unstable roll"
        print(f"{name}, exact stick: {kind} at {-roll.v_in_m_per_s:.3f} m/s")
    for friction_N in (0.0, 0.04, 0.06):
        played = on_an_arm(scene, friction_N)
        axes.plot(
            played.strikes["t_s"],
            played.strikes["speed_m_per_s"],
            ".-",
            label=f"arm, friction {friction_N} N",
        )
        gap_s = max(np.diff([*played.strikes["t_s"], 3.0]))
        print(f"{name}, friction {friction_N} N: {'rolls on' if gap_s < 0.1 else 'dies away'}")
    axes.set(xlabel="time, s", title=name)
# > firm hand, exact stick: a roll at 0.231 m/s
# > firm hand, friction 0.0 N: rolls on
# > firm hand, friction 0.04 N: rolls on
# > firm hand, friction 0.06 N: rolls on
# > loose hand, exact stick: an unstable roll at 0.060 m/s
# > loose hand, exact stick: a roll at 0.111 m/s
# > loose hand, friction 0.0 N: rolls on
# > loose hand, friction 0.04 N: dies away
# > loose hand, friction 0.06 N: dies away
loose_axes.legend()
firm_axes.set(ylabel="speed of the strike, m/s", ylim=(0.0, None))
plt.show()

# %% [markdown]
"""
Dashed: the roll of the exact stick. Dotted: a second roll, an unstable one. It is the watershed: a stick that falls
below it gets slower and slower and stays in the head, until the hand lifts it. The loose hand has one, and friction
lifts it until the two rolls meet and are gone. The firm hand has none: every start leads to the roll, which friction
only makes softer. Nobody has tried either on a real arm yet.
Why a sampled arm is not the exact stick, and what the program refuses to play on it: `sampled_wall.py`.

## And now?

- `return_map.py`: why does the roll settle, when does it not, and does the paper's formula say how fast?
- `docs/python.md` lists all names; `help(ds.simulate)` tells the rest.
- Change a number above and run the cell again.
"""
