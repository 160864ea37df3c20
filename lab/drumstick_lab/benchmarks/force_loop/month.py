"""A month of ticks, really run: drumstick lab month. Hours of processor time; it goes on where it was stopped.

The very tick that plays, of the default scene, for 30 days at 1 kHz of virtual time: 2.592e9 ticks. The month is cut
into one stretch a core, and each stretch begins with the clock and the counters that it would have by then. The clock
passes 2^53 ns, where a double no longer tells nanoseconds apart, in the middle of the month, the tick count passes
2^31. Each minute's events are taken as a gateway does, and looked at: nothing lost, nothing twice, every strike where
the exact cycle has it.

What must hold is asserted, minute by minute; what was found is stored.
"""

import argparse
import json
import multiprocessing
import os
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick_lab.measuring import stored
from drumstick_lab.soak.in_process import ticks
from drumstick_lab.soak.in_process.ticks import Comb, Counted
from drumstick_lab.soak.usage import usage
from haptic_server.records import PLAYING
from haptic_server.servo import loop
from realtime import ring
from realtime.kernels.jit import allocations

PARTS = Path(tempfile.gettempdir()) / "drumstick-month"
DAYS, MINUTES_A_DAY, TICKS_A_MINUTE = 30, 1440, 60_000
PERIOD_NS = 1_000_000
DAY_NS = MINUTES_A_DAY * TICKS_A_MINUTE * PERIOD_NS
START_NS = 2**53 - DAYS // 2 * DAY_NS
MAX_DRIFT = 1e-12  # of the cycle's length; a double's rounding is 1e-16 of it
WORST_NS = 1000.0  # of one strike from a comb of that drift


def servo_at(day: int) -> Any:
    """The default scene's servo with the counters that it has on this day, if it rolled until then."""
    servo = ticks.servo_of(parse(shipped_text("roll"), "roll"))
    ticks.begin_at(servo, Counted(day * MINUTES_A_DAY * TICKS_A_MINUTE, int(day * 86400 * ticks.ROLL_HZ)))
    return servo


class Stretch:
    """Some days in a row, of one servo."""

    def __init__(self, first_day: int, days: int) -> None:
        self.first_day, self.days, self.day = first_day, days, 0
        self.servo = servo_at(first_day)
        self.now_ns = START_NS + first_day * DAY_NS
        self.seq = int(self.servo.tick_state["seq"][0])
        self.began = self.seq
        self.comb = Comb(ticks.ROLL_HZ)
        self.rows: list[dict[str, Any]] = []
        self.out = ticks.room()

    def take(self) -> Any:
        """One minute of ticks; its strikes' residuals from the exact comb in ns, and their rebound speeds."""
        self.now_ns = ticks.run(self.servo, TICKS_A_MINUTE, self.now_ns)
        strikes = ticks.strikes_of(ticks.taken(self.servo, self.out), self.seq)
        self.seq += len(strikes)
        residual = self.comb.residuals_ns(strikes["seq"], strikes["t_ns"])
        if len(residual):
            allowed = WORST_NS + MAX_DRIFT * self.comb.since_ns
            assert np.max(np.abs(residual)) <= allowed, f"{residual[-1]} ns from the exact cycle"
        return residual

    def run_day(self) -> None:
        begun = time.process_time()
        before = allocations()
        residuals = np.concatenate([self.take() for _ in range(MINUTES_A_DAY)])
        status = self.servo.status[0]
        assert status["status"] == PLAYING
        assert status["tick"] == (self.first_day + self.day + 1) * MINUTES_A_DAY * TICKS_A_MINUTE
        assert status["overruns"] == 0 == status["refused"]
        assert self.servo.block.ring_cells[ring.DROPPED] == 0
        assert self.servo.block.ring_cells[ring.READ] == self.servo.block.ring_cells[ring.WRITTEN]
        self.day += 1
        self.rows.append(
            {
                "day": self.first_day + self.day,
                "strikes": int(status["strikes"]),
                "roll_rate_Hz": float(status["roll_rate_Hz"]),
                "v_e_m_per_s": float(status["v_e_m_per_s"]),
                "from_exact_ns": [float(residuals.min()), float(residuals.mean()), float(residuals.max())],
                "resident_kB": usage(os.getpid()).rss_kB,
                "allocations": allocations() - before,
                "processor_s": round(time.process_time() - begun, 1),
            }
        )

    def part(self) -> Path:
        return PARTS / f"{self.first_day}-{self.days}.npz"

    def keep(self) -> None:
        """So that a run that is stopped can go on."""
        PARTS.mkdir(exist_ok=True)
        arrays = dict(self._arrays())
        words = json.dumps([self.day, self.now_ns, self.seq, self.began, self.comb.origin, self.rows])
        temporary = self.part().with_suffix(".tmp.npz")
        np.savez(temporary, words=np.frombuffer(words.encode(), np.uint8), **arrays)
        temporary.replace(self.part())

    def take_up(self) -> None:
        """Go on from what an earlier run kept, if it kept anything."""
        if not self.part().exists():
            return
        with np.load(self.part()) as kept:
            for name, array in self._arrays():
                array[...] = kept[name]
            words = json.loads(bytes(kept["words"]))
        self.day, self.now_ns, self.seq, self.began, origin, self.rows = words
        self.comb.origin = tuple(origin) if origin else None

    def _arrays(self) -> list[tuple[str, Any]]:
        own = [
            (n, a) for n, a in zip(self.servo._fields, self.servo, strict=True) if isinstance(a, np.ndarray)
        ]
        block = self.servo.block
        shared = [(f"block_{n}", a) for n, a in zip(block._fields, block, strict=True)]
        return own + shared


def play(stretch: tuple[int, int]) -> list[dict[str, Any]]:
    mine = Stretch(*stretch)
    mine.take_up()
    while mine.day < mine.days:
        mine.run_day()
        mine.keep()
        print(json.dumps(mine.rows[-1]), flush=True)
    return mine.rows


def of_stretch(rows: list[dict[str, Any]], first: int, days: int) -> list[dict[str, Any]]:
    return [row for row in rows if first < row["day"] <= first + days]


def memory_growth_kb(rows: list[dict[str, Any]]) -> int:
    """Growth of memory from the first days to the last ones; on the very first one this script makes its own arrays."""
    days = max(len(rows) // 3, 1)
    return max(r["resident_kB"] for r in rows[-days:]) - max(r["resident_kB"] for r in rows[1 : 1 + days])


def summary(rows: list[dict[str, Any]], stretches: list[tuple[int, int]]) -> dict[str, Any]:
    """Summary of all days."""
    ticks = DAYS * MINUTES_A_DAY * TICKS_A_MINUTE
    ends = [(own[0], own[-1]) for own in (of_stretch(rows, *stretch) for stretch in stretches)]
    rates = [row["roll_rate_Hz"] for row in rows]
    spent_s = sum(row["processor_s"] for row in rows)
    return {
        "ticks": ticks,
        "start_ns": START_NS,
        "stretches_days": stretches,
        "strikes": rows[-1]["strikes"],
        "dropped": 0,
        "drift_of_the_cycle": [
            (last["from_exact_ns"][1] - first["from_exact_ns"][1]) / ((last["day"] - first["day"]) * DAY_NS)
            for first, last in ends
        ],
        "furthest_from_exact_ns": max(abs(ns) for row in rows for ns in row["from_exact_ns"]),
        "roll_rate_Hz": [min(rates), max(rates)],
        "resident_growth_kB": [memory_growth_kb(of_stretch(rows, *stretch)) for stretch in stretches],
        "processor_s": spent_s,
        "ns_a_tick": 1e9 * spent_s / ticks,
    }


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--cores", type=int, default=2, choices=(1, 2, 3, 5, 6, 10))
    days = DAYS // arguments.parse_args().cores
    os.nice(19)
    stretches = [(first, days) for first in range(0, DAYS, days)]
    loop.run_virtual(servo_at(0), 1, 0)  # compiled once, before there are several processes
    with multiprocessing.get_context("spawn").Pool(len(stretches)) as pool:
        rows = [row for found in pool.map(play, stretches, chunksize=1) for row in found]
    result = {**summary(rows, stretches), "days": rows}
    stored.store("month", result)
    print(json.dumps({key: value for key, value in result.items() if key != "days"}, indent=1))
    for first, count in stretches:
        Stretch(first, count).part().unlink()


if __name__ == "__main__":
    main()
