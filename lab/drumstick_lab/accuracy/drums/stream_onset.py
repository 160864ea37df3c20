"""Delay of a streamed contact up to the sound card, computed from what runs: the sound server's own delay of a stream, and
what its parabolas, the mesh and its interpolator make of a blow, rendered with the pickup under it.

A rig that played was measured at one rate of the servo (lab/results/strike_latency.json); its arm's driver gives that.
The same computed for that rate stands beside it, so that what is computed for another one can be judged. The network is
left out: it decides whether a piece comes in time, not when it sounds. Any thread; blocks while it renders.
"""

import dataclasses
import math

import numpy as np
import numpy.typing as npt

from drumstick.drum.render import render
from drumstick_lab.accuracy.drums import blows
from drumstick_lab.accuracy.drums.footprint import ABOVE
from sound_server.receiving.contacts import own_delay_s

PLACES = 16  # between two ticks
_RATE_Hz = 48_000
_PERCENTILES = (1, 50, 99)
_BEGIN_S, _HEARD_S = 0.05, 0.1


def onsets_s(rate_Hz: float, block: int, places: int = PLACES) -> npt.NDArray[np.float64]:
    """From a contact to the first sample above ABOVE of its peak, s, for contacts evenly spread between two ticks of a
    servo of rate_Hz, in audio blocks of so many samples at 48 kHz; shape (places,)."""
    scene = blows.scene(True)
    scene = dataclasses.replace(
        scene, listen=dataclasses.replace(scene.listen, pickups=((*blows.PLACE, 0.0),))
    )
    delay_s = own_delay_s(scene.drum.latency_s, block / _RATE_Hz)
    found = np.zeros(places)
    for k in range(places):
        at_s = (math.floor(_BEGIN_S * rate_Hz) + (k + 0.5) / places) / rate_Hz
        press = blows.press_of(blows.true_impulse(), at_s, rate_Hz)
        loud = np.abs(render(scene, [], _HEARD_S, _RATE_Hz, [press])[:, 0])
        found[k] = float(np.argmax(loud > ABOVE * loud.max())) / _RATE_Hz - at_s + delay_s
    return found


def percentiles_ms(onsets_s: npt.NDArray[np.float64]) -> dict[str, float]:
    """Milliseconds p1, p50 and p99, as a rig's delays are stored."""
    return {f"p{of}": round(1e3 * float(np.percentile(onsets_s, of)), 3) for of in _PERCENTILES}
