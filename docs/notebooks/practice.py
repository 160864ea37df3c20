# %% [markdown]
"""
# Does practice carry over to a drum?

For researchers who run a study with `drumstick study` (`docs/study.md`) and want to see what its tables are good for.
The paper asks whether practice on the haptic drumstick helps on a real drum. Nobody has measured it.

**All data here is synthetic.** The players are a formula with random numbers, and they learn because the formula says
so. The figures show what an analysis looks like and that it finds what was put in, nothing about people.
"""

# %%
import csv

import matplotlib.pyplot as plt
import numpy as np

import drumstick as ds

# %% [markdown]
"""
## Synthetic players

Each strike comes from a timekeeper and a motor delay, after Wing and Kristofferson: an interval is one of the
timekeeper, plus the delay of the strike that ends it, less the delay of the one before. While the metronome sounds,
a player also takes back a share of the last asynchrony, and is early by habit (Repp). Then it stops, and the player
goes on alone.
"""

# %%
INTERVAL_S, SYNCHRONISED, ALONE = 0.4, 20, 60
EARLY_S, MOTOR_SD_S, TAKEN_BACK = 0.025, 0.006, 0.4
random = np.random.default_rng(2007)


def played(timekeeper_sd_s: float) -> np.ndarray:
    """Times of the strikes of one block, s; the first beat is at 0."""
    count = SYNCHRONISED + ALONE
    delays_s = random.normal(0.0, MOTOR_SD_S, count)
    clock_s = np.empty(count)
    clock_s[0] = -EARLY_S
    for k in range(1, count):
        asynchrony_s = clock_s[k - 1] + delays_s[k - 1] - (k - 1) * INTERVAL_S
        back_s = TAKEN_BACK * (asynchrony_s + EARLY_S) if k < SYNCHRONISED else 0.0
        clock_s[k] = clock_s[k - 1] + random.normal(INTERVAL_S, timekeeper_sd_s) - back_s
    return clock_s + delays_s


beats_s = INTERVAL_S * np.arange(SYNCHRONISED)
strikes_s = played(0.020)
led = ds.timing(strikes_s[:SYNCHRONISED], beats_s, interval_s=INTERVAL_S)
alone = ds.timing(strikes_s[SYNCHRONISED:], interval_s=INTERVAL_S)
print(f"asynchrony {led.asynchrony_mean_ms:.0f} ms, SD {led.asynchrony_sd_ms:.0f} ms, {led.misses} misses")
print(f"alone: intervals {100 * alone.interval_variation:.1f} % uneven, lag-1 {alone.interval_lag1:.2f}")
# > asynchrony -24 ms, SD 20 ms, 0 misses
# > alone: intervals 4.6 % uneven, lag-1 -0.06

# %% [markdown]
"""
`ds.timing` gives all measures of a block; `drumstick study export` writes them as columns of the same names. The lag-1
autocorrelation of one block is a rough number: it takes many strikes to tell the timekeeper from the hand.
"""

# %%
many = ds.timing(
    np.concatenate([played(0.020)[SYNCHRONISED:] + 1e3 * k for k in range(50)]), interval_s=INTERVAL_S
)
print(
    f"{many.intervals} intervals: timekeeper {many.timekeeper_sd_ms:.0f} ms, motor {many.motor_sd_ms:.0f} ms"
)
# > 2950 intervals: timekeeper 20 ms, motor 6 ms

# %% [markdown]
"""
## A study

Two groups play a drum pad in the first and in the last session. One of them practises on the haptic stick in every
session, the other does not practise. Without the second group nobody could tell practice from getting used to the test.
In our formula practice makes the timekeeper steadier, and a share of that, `CARRIED_OVER`, shows on the pad. We write
the table as the export does.
"""

# %%
SESSIONS, PLAYERS, CARRIED_OVER = 8, 24, 0.5
LEARNS_S, SESSIONS_TO_LEARN = 0.012, 2.0
COLUMNS = ("player", "session", "block_name", "phase", "interval_mean_ms", "interval_variation")


def steadier_s(session: int) -> float:
    return LEARNS_S * (1.0 - np.exp(-(session - 1) / SESSIONS_TO_LEARN))


def row(player: str, session: int, name: str, timekeeper_sd_s: float) -> dict[str, object]:
    of = ds.timing(played(timekeeper_sd_s)[SYNCHRONISED:], interval_s=INTERVAL_S)
    measures = {column: getattr(of, column) for column in COLUMNS[4:]}
    return {"player": player, "session": session, "block_name": name, "phase": "continuation", **measures}


rows = []
for number in range(1, PLAYERS + 1):
    player, practises, own_sd_s = f"p{number:02}", number % 2 == 0, random.uniform(0.018, 0.024)
    for session in range(1, SESSIONS + 1):
        gained_s = steadier_s(session) if practises else 0.0
        if session in (1, SESSIONS):
            rows.append(row(player, session, "pad", own_sd_s - CARRIED_OVER * gained_s))
        if practises:
            rows.append(row(player, session, "stick", own_sd_s - gained_s))

with open("synthetic-blocks.csv", "w", encoding="utf-8", newline="") as file:
    writer = csv.DictWriter(file, COLUMNS)
    writer.writeheader()
    writer.writerows(rows)
print(len(rows), "blocks")
# > 144 blocks

# %% [markdown]
"""
## From the table

From here on it is the same for a study with people: put the name of your own `...-blocks.csv` in place of this one, and
your blocks' names.
"""

# %%
with open("synthetic-blocks.csv", encoding="utf-8", newline="") as file:
    table = [each for each in csv.DictReader(file) if each["phase"] == "continuation"]

unevenness = {
    (each["player"], each["block_name"], int(each["session"])): 100.0 * float(each["interval_variation"])
    for each in table
}
first, last = min(key[2] for key in unevenness), max(key[2] for key in unevenness)
practised = sorted({player for player, name, _ in unevenness if name == "stick"})
others = sorted({player for player, _, _ in unevenness} - {*practised})


def curve(players: list[str], name: str, sessions: range) -> np.ndarray:
    """Unevenness of the intervals, per cent; players in rows, sessions in columns."""
    return np.array([[unevenness[player, name, session] for session in sessions] for player in players])


learning = curve(practised, "stick", range(first, last + 1))
pad = {
    group: np.array([[unevenness[player, "pad", session] for session in (first, last)] for player in players])
    for group, players in (("practised", practised), ("did not", others))
}

figure, (left, right) = plt.subplots(1, 2, sharey=True, layout="constrained", figsize=(9, 4))
sessions = np.arange(first, last + 1)
left.plot(sessions, learning.T, color="grey", linewidth=0.6)
left.plot(sessions, learning.mean(axis=0), "o-", color="tab:blue", label="mean of those who practised")
left.set(
    xlabel="session", ylabel="SD of intervals over their mean, %", title="On the stick (synthetic players)"
)
left.legend()
for (group, before_after), colour in zip(pad.items(), ("tab:blue", "tab:orange"), strict=True):
    right.plot([0, 1], before_after.T, color=colour, linewidth=0.5, alpha=0.5)
    right.plot([0, 1], before_after.mean(axis=0), "o-", color=colour, linewidth=2.5, label=group)
right.set(xticks=[0, 1], xticklabels=["pad before", "pad after"], title="On a pad (synthetic players)")
right.legend()
plt.show()

# %% [markdown]
"""
## Did it carry over?

Each player's gain on the pad is before less after. The groups are compared by a permutation test: if practice did
nothing, who is in which group is mere chance, and so we deal the gains out again at random, many times, and count how
often the difference of the means is as large. The share that carried over is the gain on the pad beyond that of the
others, over the gain on the stick.
"""

# %%
gains = {group: before_after[:, 0] - before_after[:, 1] for group, before_after in pad.items()}
difference = gains["practised"].mean() - gains["did not"].mean()
dealt = np.concatenate([*gains.values()])
by_chance = []
for _ in range(10_000):
    random.shuffle(dealt)
    by_chance.append(dealt[: len(practised)].mean() - dealt[len(practised) :].mean())
p = (1 + np.sum(np.abs(by_chance) >= abs(difference))) / (1 + len(by_chance))
on_stick = (learning[:, 0] - learning[:, -1]).mean()
print(
    f"gain in percentage points: {on_stick:.1f} on the stick, {difference:.1f} on the pad beyond the others"
)
print(f"carried over: {difference / on_stick:.2f}, put in: {CARRIED_OVER}; p = {p:.4f}")
# > gain in percentage points: 2.7 on the stick, 1.1 on the pad beyond the others
# > carried over: 0.43, put in: 0.5; p = 0.0009

# %% [markdown]
"""
The analysis finds about what was put in, within what chance does to so few players. With people nobody knows the
answer: plan how many players you need before you begin (run this notebook with fewer `PLAYERS`, or with less
`CARRIED_OVER`, and with other seeds, and see how often it still shows), and say beforehand which measure decides.

- `docs/study.md`: the task file, the commands, the measures, privacy.
- Change a number above and run the cell again.
"""
