"""From the servo's samples to pieces of contacts: what one Contact message carries."""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from protocol.messages import CONTACT_PIECE_S, Contact

# Beyond this nobody can play it any more, not with the longest latency of a scene and of a room, half a second each.
# The gateway was away or held up.
_TOO_OLD_NS = 1_100_000_000


class Pieces:
    """Gathers samples, SAMPLE records in the order of the ring, at rate_Hz. One thread."""

    def __init__(self, rate_Hz: float) -> None:
        self._rate_Hz = rate_Hz
        self._most = max(1, round(CONTACT_PIECE_S * rate_Hz))
        self._patience_ns = round(2e9 * (CONTACT_PIECE_S + 1.0 / rate_Hz))
        self._first: tuple[int, int, int, float, float] | None = None  # seq, tick, t_ns, x, y
        self._forces: list[float] = []
        self.stale = 0

    def clear(self) -> None:
        """Forget what was gathered."""
        self._first, self._forces = None, []

    def of(self, boot: int, samples: Iterable[Any], now_ns: int) -> Iterator[Contact]:
        """The pieces that are full or closed with these samples, or that have waited too long for more."""
        for sample in samples:
            seq, tick, t_ns = int(sample["seq"]), int(sample["tick"]), int(sample["t_ns"])
            if now_ns - t_ns > _TOO_OLD_NS:
                self.stale += 1
                continue
            if self._first is not None and (seq, tick) != (
                self._first[0],
                self._first[1] + len(self._forces),
            ):
                yield self._piece(boot)
            if self._first is None:
                self._first = (seq, tick, t_ns, float(sample["x"]), float(sample["y"]))
            force_N = float(sample["force_N"])
            self._forces.append(force_N)
            if force_N == 0.0 or len(self._forces) >= self._most:
                yield self._piece(boot)
        if self._first is not None and now_ns - self._first[2] > self._patience_ns:
            yield self._piece(boot)

    def _piece(self, boot: int) -> Contact:
        assert self._first is not None
        seq, tick, t_ns, x, y = self._first
        forces = np.array(self._forces, "<f4").tobytes()
        self.clear()
        return Contact(
            boot=boot, seq=seq, first_tick=tick, rate_Hz=self._rate_Hz, forces=forces, t_ns=t_ns, x=x, y=y
        )
