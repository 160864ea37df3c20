"""Sweeps and curves as CSV: one row a point, SI units in the header, an empty cell where there is no value."""

import csv
import io
import itertools
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from drumstick.analysis.cycles.sweep import KINDS, MEASURED, Swept
from drumstick.parameters.scene import Scene
from drumstick.scenes.table import table_of
from rig.figures.effective import Restitution
from rig.figures.predictions import Forecast
from rig.figures.return_map import Curves

Numbers = npt.NDArray[np.float64]


def _cell(value: float) -> str:
    return "" if math.isnan(value) else repr(float(value))


def _text(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return out.getvalue()


def columns(named: dict[str, Numbers]) -> str:
    """Columns of equal length, by name."""
    rows = [[_cell(value) for value in row] for row in zip(*named.values(), strict=True)]
    return _text(list(named), rows)


def mapped(curves: Curves) -> str:
    """The return map; what a throw that comes to rest in the head gives is empty, and so are speeds no roll has."""
    return columns(
        {
            "v_e_m_per_s": curves.v_e,
            "next_contact_after_contact_m_per_s": curves.rolling,
            "next_after_a_throw_m_per_s": curves.thrown,
        }
    )


def given_back(found: Restitution) -> str:
    """Restitutions beta^ and beta over the speed of the blow; empty where the stick stays in the head."""
    return columns(
        {
            "v_in_m_per_s": found.v,
            "beta_effective": found.effective,
            "beta_without_pulses": found.unpulsed,
        }
    )


def forecast(found: Forecast) -> str:
    """The three speeds of the roll over dv, and the cycles of period 1, by increasing v_E."""
    named = {
        "dv_m_per_s": found.dv,
        "v_lc_eq7_m_per_s": found.eq7,
        "v_lc_kappa_m_per_s": found.kappa,
        "v_lc_settled_m_per_s": found.settled,
    }
    for kind, speeds in (("stable", found.stable), ("unstable", found.unstable)):
        for k in range(speeds.shape[1]):
            if np.isfinite(speeds[:, k]).any():
                named[f"v_lc_{kind}_{k + 1}_m_per_s"] = speeds[:, k]
    return columns(named)


def swept(scene: Scene, done: Swept) -> str:
    """Every point of a sweep in the order of its axes.

    Over one parameter all MEASURED last speeds are given, over two their lowest and highest.
    """
    table = table_of(scene)
    speeds = done.v_e_m_per_s
    named = [f"v_e_{i + 1}_m_per_s" for i in range(MEASURED)]
    if len(done.axes) > 1:
        speeds = np.stack((speeds.min(axis=-1), speeds.max(axis=-1)), axis=-1)
        named = ["v_e_lowest_m_per_s", "v_e_highest_m_per_s"]
    header = [f"{axis.name} ({table[axis.name].quantity.unit})" for axis in done.axes]
    header += ["outcome", "rate_Hz", "period", *named]
    rows: list[list[str]] = []
    for place in itertools.product(*(range(len(axis.values)) for axis in done.axes)):
        at = [_cell(axis.values[i]) for axis, i in zip(done.axes, place, strict=True)]
        outcome = [
            KINDS[int(done.kind[place])],
            _cell(float(done.rate_Hz[place])),
            str(int(done.period[place])),
        ]
        rows.append([*at, *outcome, *map(_cell, speeds[place])])
    return _text(header, rows)
