"""The servo rates of a PHANTOM. Any thread.

On FireWire the bus has 8000 cycles a second and the servo takes every Nth: floor(8000/N + 0.5) Hz. Parallel and PCI
cards have 500, 1000 and 2000 Hz, which are among them. What a USB arm takes is the driver's to say.
"""

_CYCLES_PER_S = 8000
_SLOWEST_N, _FASTEST_N = 16, 4

CARD_RATES_HZ = (500, 1000, 2000)
FIREWIRE_RATES_HZ = tuple(
    int(_CYCLES_PER_S / n + 0.5) for n in range(_SLOWEST_N, _FASTEST_N - 1, -1)
)  # 500 .. 2000 Hz


def refusal(rate_Hz: int) -> str:
    """Message for a rate that the driver refused."""
    near = sorted(sorted(FIREWIRE_RATES_HZ, key=lambda r: (abs(r - rate_Hz), r))[:3])
    return (
        f"the driver refuses a servo rate of {rate_Hz} Hz: set [servo] rate_Hz to 500, 1000 or 2000 "
        f"(FireWire also takes 8000/N, near yours {', '.join(str(r) for r in near)})"
    )
