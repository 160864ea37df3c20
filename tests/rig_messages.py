"""Messages of a rig for tests that look at a few of their values: the others have values that say nothing."""

from typing import Any

from protocol.messages import State, Strike


def state(**values: Any) -> State:
    """A servo's state, playing; the stick at rest in the middle of the head."""
    said: dict[str, Any] = {
        "boot": 1, "t_ns": 0, "status": "playing", "z_m": 0.0, "v_m_per_s": 0.0, "force_N": 0.0, "x": 0.0, "y": 0.0,
        "roll_rate_Hz": 0.0, "v_e_m_per_s": 0.0, "strikes": 0, "ticks": 0, "overruns": 0, "lateness_p99_us": 0.0,
        "lateness_worst_us": 0.0, "ring_dropped": 0, "revision": 0, "pending": False,
    }  # fmt: skip
    return State(**said | values)


def strike(**values: Any) -> Strike:
    """A strike of 1 m/s in the middle of the head."""
    said: dict[str, Any] = {
        "boot": 1, "seq": 1, "t_ns": 0, "x": 0.0, "y": 0.0, "z_speed_m_per_s": 1.0, "level": 0.5,
        "peak_estimate_N": 1.0, "contact_estimate_s": 0.005,
    }  # fmt: skip
    return Strike(**said | values)
