"""Messages between the panel and the process that computes: one JSON object a line, `type` says which."""

from typing import Any, Literal

import msgspec


class PredictRoll(msgspec.Struct, frozen=True, tag="predict_roll"):
    """A scene as tables, the values that would hold (wire names, SI), and what device and scene allow; {}: the scene's
    own guard. Answered by PredictedRoll."""

    scene: dict[str, Any]
    values: dict[str, float]
    limits: dict[str, float]


class FindTheory(msgspec.Struct, frozen=True, tag="theory"):
    """A scene as tables, and what the servo uses (wire names, SI). Answered by Theory."""

    scene: dict[str, Any]
    values: dict[str, float]


class TimeTicks(msgspec.Struct, frozen=True, tag="ticks"):
    """A scene as tables. Answered by Ticks."""

    scene: dict[str, Any]


class FindReach(msgspec.Struct, frozen=True, tag="find_reach"):
    """A scene as tables, what the servo uses (wire names, SI), and what device and scene allow; {}: the scene's own
    guard. Answered by Reach."""

    scene: dict[str, Any]
    values: dict[str, float]
    limits: dict[str, float]


class PredictedRoll(msgspec.Struct, frozen=True, tag="predicted_roll"):
    """End of a throw with these values, by the exact motion. `refusal` is not empty when the envelope
    would not accept them. v_lc is the speed after the strongest contact of the cycle; the dominant multiplier says how
    a small departure grows (above 1) or dies away. `open`: lowest and highest value, SI, of each parameter, by its wire
    name, that the envelope would accept with the others as they are; only where that is less than the table's range,
    and of values that are accepted themselves.
    """

    end: Literal["cycle", "captured", "left", "unsettled", "endless", ""] = ""
    v_lc_m_per_s: float | None = None
    rate_Hz: float | None = None
    multiplier: float | None = None
    period: int = 0
    refusal: str = ""
    open: dict[str, tuple[float, float]] = {}


Curve = tuple[list[float], list[float]]
_NO_CURVE: Curve = ([], [])


class Theory(msgspec.Struct, frozen=True, tag="theory"):
    """rising, falling: z (mm) and v (m/s) of the fastest stable cycle; mapped: v_E and the next v_E (m/s); stable: the
    fixed points, twice. Each empty where there is none. ends: which stable ends there are, in words.
    """

    rising: Curve = _NO_CURVE
    falling: Curve = _NO_CURVE
    mapped: Curve = _NO_CURVE
    stable: Curve = _NO_CURVE
    ends: str = ""


class Reach(msgspec.Struct, frozen=True, tag="reach"):
    """Rolls that can be asked for: rate Hz and level of the present one, and at each of some levels the slowest and the
    fastest, Hz. `why` is not empty when there are none.
    """

    why: str = ""
    rate_Hz: float = 0.0
    level: float = 0.0
    levels: list[float] = []
    slowest_Hz: list[float] = []
    fastest_Hz: list[float] = []


class Ticks(msgspec.Struct, frozen=True, tag="ticks"):
    """ns a tick on this machine: with all effects ("all"), without each, without any ("none")."""

    ns: dict[str, float]
    rate_Hz: float


class Trouble(msgspec.Struct, frozen=True, tag="trouble"):
    """Failure to answer; `why`, in words. True `passes`: the process ended, and may answer when it is asked again."""

    why: str
    passes: bool = False


Question = PredictRoll | FindTheory | TimeTicks | FindReach
Answer = PredictedRoll | Theory | Ticks | Reach | Trouble
