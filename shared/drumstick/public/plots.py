"""Pictures of what was computed. matplotlib is imported when the first one is drawn."""

from typing import TYPE_CHECKING

import numpy.typing as npt

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def over_time(title: str, t_s: npt.ArrayLike, panels: dict[str, npt.ArrayLike]) -> "Figure":
    """One panel a label, all over the same time. A notebook shows the figure; elsewhere `matplotlib.pyplot.show()`.

    Raises ImportError, worded, without matplotlib.
    """
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError(
            "pictures need matplotlib: pip install 'haptic-drumstick[figures]'", name=error.name
        ) from error

    figure, axes = pyplot.subplots(len(panels), 1, sharex=True, squeeze=False, layout="constrained")
    for panel, (label, values) in zip(axes[:, 0], panels.items(), strict=True):
        panel.plot(t_s, values, linewidth=1.0)
        panel.set_ylabel(label)
    axes[0, 0].set_title(title)
    axes[-1, 0].set_xlabel("time, s")
    return figure
