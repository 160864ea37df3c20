"""The head's surface of a bank of modes, as it is shown: by its lowest modes. Any thread; allocates.

Their shapes are summed by whoever shows them, not by the audio thread.
"""

import numpy as np

from drumstick.drum.membrane.surface import Places, rings
from drumstick.drum.modal.covered import covered_by, turned
from drumstick.drum.modal.modes import modes_below, shapes_at
from drumstick.parameters.drum import Drum

_HIGHEST_ZERO = (
    24.0  # of the modes that are shown: waves down to a quarter of the radius, as the rings can show
)


def of_modes(highest_zero: float, drum: Drum) -> Places:
    """Places on a bank of the drum's modes up to this zero: the lowest, those of cos(m phi), then of sin(m phi)."""
    all_of_them = len(modes_below(highest_zero).zeros)
    modes = modes_below(min(highest_zero, _HIGHEST_ZERO))
    count = len(modes.zeros)
    shapes = np.array(
        [np.concatenate(shapes_at(modes, float(x), float(y))) for x, y in zip(*rings(), strict=True)]
    )
    covered = covered_by(highest_zero, drum)
    if covered is not None:
        shapes = turned(shapes, covered._replace(turn=covered.turn[:, :count]))
    places = np.concatenate([np.arange(count), all_of_them + np.arange(count)])
    return Places(places[:, None], np.ones((2 * count, 1), np.float32), shapes)
