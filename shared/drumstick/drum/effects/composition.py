"""Composition of a drum's effects, folded in the order of the registry: what the step, the mallets and the blows ask.

Each function here calls the function of its name of every effect that the scene names and that has one; its own body is
what remains without any. A term that the sweep has only once is `single`: None where no effect gives it, and then it is
not computed. Kernels: audio thread; no allocation.
"""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects.registry import EFFECTS
from realtime.kernels.folding import added, any_of, each, folded, single

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine

Floats = npt.NDArray[np.float32]


@folded(EFFECTS, each)
def resume(engine: "Engine") -> None:
    """Take up what was set while the head was at rest, before anything lies on it."""


@folded(EFFECTS, each)
def reset(engine: "Engine") -> None:
    """Set all to rest."""


@folded(EFFECTS, added)
def taken_in(engine: "Engine", frames: int) -> int:
    """Take in what comes from outside in this block; more than 0 if something of it is to push the head."""
    return 0


@folded(EFFECTS, each)
def begin_step(engine: "Engine") -> None:
    """Clear what the blows of the last step left, before this step's forces."""


@folded(EFFECTS, each)
def struck(engine: "Engine", x: float, y: float, impulse: float) -> None:
    """Note a blow of so much impulse, N steps, at (x, y), in radii."""


@folded(EFFECTS, added)
def taken_share(engine: "Engine", x: float, y: float) -> float:
    """Share of a blow at (x, y), in radii, that does not come to the head."""
    return 0.0


@folded(EFFECTS, each)
def before_sweep(engine: "Engine", u_old: Floats) -> None:
    """Keep what is needed of u-, before the sweep overwrites it, and move what moves only between steps."""


@folded(EFFECTS, single)
def head_push(engine: "Engine") -> Any:
    """f of the sweep: what pushes all of the head."""
    return None


@folded(EFFECTS, single)
def asked_sum(engine: "Engine") -> Any:
    """Anything but None asks the sweep for the sum of u+."""
    return None


@folded(EFFECTS, single)
def momentum(engine: "Engine") -> Any:
    """p of the sweep: the junctions' momentum."""
    return None


@folded(EFFECTS, single)
def rho(engine: "Engine") -> Any:
    """Share of the momentum that a step leaves."""
    return None


@folded(EFFECTS, single)
def eta(engine: "Engine") -> Any:
    """Share of the pull that acts besides the momentum."""
    return None


@folded(EFFECTS, single)
def tightened(engine: "Engine", u: Floats, u_old: Floats, push: float) -> float:
    """q of this step: by how much the tension is raised. push: f of the whole head."""
    return 0.0


@folded(EFFECTS, single)
def junction_pushes(engine: "Engine") -> Any:
    """By how much each junction is pushed in this step besides, shape (J,); known before the sweep."""
    return None


@folded(EFFECTS, single)
def neighbour_gain(engine: "Engine", q: float) -> Any:
    """Gain of the neighbours' sum, for that q."""
    return None


@folded(EFFECTS, single)
def own_loss(engine: "Engine", q: float) -> float:
    """By how much less u counts in its own next value, for that q."""
    return 0.0


@folded(EFFECTS, single)
def tightness(engine: "Engine", q: float) -> Any:
    """Gain of A u that this q adds in the fourth order."""
    return np.float32(0.0)


@folded(EFFECTS, each)
def pushed(engine: "Engine", junction: int, step: float) -> None:
    """Note that a force has moved a junction by `step`."""


@folded(EFFECTS, added)
def after_sweep(engine: "Engine", u_new: Floats) -> float:
    """Move u+ after the sweep; returns by how much its sum changed."""
    return 0.0


@folded(EFFECTS, each)
def sweep_beside(engine: "Engine", present_level: int, total: float) -> None:
    """Step what lies beyond the head; total: the sum of the head's u+."""


@folded(EFFECTS, added)
def on_second_head(engine: "Engine", present_level: int) -> float:
    """Move what lies on the second head, after its sweep; returns by how much the sum of its u+ changed."""
    return 0.0


@folded(EFFECTS, each)
def second_moved(engine: "Engine", changed: float) -> None:
    """Note by how much the sum of the second head's u+ changed after its sweep."""


@folded(EFFECTS, added)
def picked_up(engine: "Engine", present_level: int) -> Any:
    """Signal of pickups besides that of the head: left and right, of one effect after the other."""
    return 0.0, 0.0


@folded(EFFECTS, added)
def added_output(engine: "Engine") -> float:
    """One step of what sounds besides the head, and what is heard of it."""
    return 0.0


@folded(EFFECTS, each)
def before_modes(engine: "Engine", steps: int) -> None:
    """Move what moves only between steps of a bank, by as much as it may in so many steps."""


@folded(EFFECTS, any_of)
def is_moving(engine: "Engine") -> bool:
    """True while something is not yet where it was set to."""
    return False


@folded(EFFECTS, single)
def press(engine: "Engine") -> float:
    """Pressure, 0 to 1, of what lies on the head."""
    return 0.0


@folded(EFFECTS, any_of)
def has_moved(engine: "Engine") -> bool:
    """True in a step in which the head gives way otherwise than before: whoever knows how it does looks again."""
    return False


@folded(EFFECTS, single)
def held_junctions(engine: "Engine") -> Any:
    """Junctions of which something holds a share of every movement; they rise."""
    return None


@folded(EFFECTS, single)
def held_share(engine: "Engine") -> float:
    """Share of every movement that is held."""
    return 0.0
