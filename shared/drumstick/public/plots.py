"""Pictures of what was computed. matplotlib is imported when the first one is drawn."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy.typing as npt

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def over_time(title: str, t_s: npt.ArrayLike, panels: dict[str, npt.ArrayLike]) -> "Figure":
    """One panel a label, all over the same time. A notebook shows the figure where it is the last line of a cell.

    Elsewhere `matplotlib.pyplot.show()` does. Raises ImportError, worded, without matplotlib.
    """
    figure, axes = _subplots(len(panels), 1, sharex=True, squeeze=False)
    for panel, (label, values) in zip(axes[:, 0], panels.items(), strict=True):
        panel.plot(t_s, values, linewidth=1.0)
        panel.set_ylabel(label)
    axes[0, 0].set_title(title)
    axes[-1, 0].set_xlabel("time, s")
    return figure


class FixedPoint(NamedTuple):
    """A roll that repeats from one contact to the next: its speed, m/s; the legend's words."""

    v_e_m_per_s: float
    stable: bool
    words: str


def return_map(
    title: str, v_e_m_per_s: npt.ArrayLike, next_m_per_s: npt.ArrayLike, fixed: Iterable[FixedPoint]
) -> "Figure":
    """Speed after one contact against the speed after the next, as `over_time`.

    Where the curve meets the diagonal is a roll: a filled circle if it is stable.
    """
    figure, axes = _subplots(1, 1)
    axes.plot(v_e_m_per_s, v_e_m_per_s, color="grey", linewidth=0.8, label="no change")
    axes.plot(v_e_m_per_s, next_m_per_s, label="one contact later")
    for at, stable, words in fixed:
        axes.plot(at, at, "o", color="black", markerfacecolor="black" if stable else "white", label=words)
    axes.set_title(title)
    axes.set_xlabel("speed after a contact, m/s")
    axes.set_ylabel("speed after the next contact, m/s")
    axes.legend()
    return figure


def _subplots(rows: int, columns: int, **more: Any) -> Any:
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError(
            "pictures need matplotlib: pip install 'haptic-drumstick[figures]'", name=error.name
        ) from error

    figure, axes = pyplot.subplots(rows, columns, layout="constrained", **more)
    if "inline" in pyplot.get_backend():
        pyplot.close(figure)  # a notebook shows what a cell returns, and every open figure once more
    return figure, axes
