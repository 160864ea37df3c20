"""Agreement of contacts with what their strikes announced: peak force and impulse, in dB.

A strike and its release are found together by servo start and number, in whichever order they come, however many are
lost, and once even if they come again. One thread; bounded memory.
"""

import math
import statistics
from collections import OrderedDict, deque
from dataclasses import dataclass
from typing import NamedTuple

from protocol.messages import STICK, Release, Strike

KEPT = 100  # contacts that are told about
_REMEMBERED = 1024  # strikes and releases that wait for each other, and pairs that were found
# What a strike is held to on the median: the exact stick keeps 0.5 and 0.1 dB, an arm whose hand moves 1 and 0.5 dB.
PEAK_WITHIN_dB, IMPULSE_WITHIN_dB = 1.0, 0.5


class Deviation(NamedTuple):
    """Announced to real, dB: above 0 the strike announced too much. `worst` is the one farthest from 0."""

    median_dB: float
    worst_dB: float

    @property
    def words(self) -> str:
        """One sentence."""
        return f"{_signed(self.median_dB)} dB (worst {_signed(self.worst_dB)} dB)"


class Report(NamedTuple):
    """Report on the newest contacts, `contacts` of them."""

    contacts: int
    peak: Deviation
    impulse: Deviation

    @property
    def is_good(self) -> bool:
        """True when strikes announce what the stick then does."""
        return abs(self.peak.median_dB) <= PEAK_WITHIN_dB and abs(self.impulse.median_dB) <= IMPULSE_WITHIN_dB


def _signed(value_dB: float) -> str:
    return f"{round(value_dB, 1) + 0.0:+.1f}"


def _ratio_dB(announced: float, real: float) -> float:  # noqa: N802
    # Of any two numbers above 0 that a network may deliver: their ratio may be none.
    return 20.0 * (math.log10(announced) - math.log10(real))


def _off(values_dB: list[float]) -> Deviation:
    return Deviation(statistics.median(values_dB), max(values_dB, key=abs))


@dataclass
class _Pair:
    strike: Strike | None = None
    release: Release | None = None
    is_counted: bool = False


class Announcements:
    """Announcements and contacts of one rig, compared."""

    def __init__(self) -> None:
        self._pairs: OrderedDict[tuple[int, int], _Pair] = OrderedDict()
        self._offs: deque[tuple[float, float]] = deque(maxlen=KEPT)

    def note_strike(self, strike: Strike) -> None:
        """Take a strike; one that is not the stick's, or tells no impulse, announces nothing."""
        if strike.source == STICK and strike.peak_estimate_N > 0.0 and strike.impulse_N_s > 0.0:
            pair = self._pair(strike.boot, strike.seq)
            pair.strike = strike
            self._compare(pair)

    def note_release(self, release: Release) -> None:
        """Take a release; that of a contact that a panic or a fault cut short says nothing about its strike."""
        told = release.exit_speed_m_per_s > 0.0 and release.peak_N > 0.0 and release.impulse_N_s > 0.0
        if release.source == STICK and told:
            pair = self._pair(release.boot, release.seq)
            pair.release = release
            self._compare(pair)

    def report(self) -> Report | None:
        """Present agreement; None before a contact was heard from beginning to end."""
        if not self._offs:
            return None
        peaks, impulses = zip(*self._offs, strict=True)
        return Report(len(self._offs), _off(list(peaks)), _off(list(impulses)))

    def _pair(self, boot: int, seq: int) -> _Pair:
        pair = self._pairs.setdefault((boot, seq), _Pair())
        if len(self._pairs) > _REMEMBERED:
            self._pairs.popitem(last=False)
        return pair

    def _compare(self, pair: _Pair) -> None:
        if pair.is_counted or pair.strike is None or pair.release is None:
            return
        pair.is_counted = True
        peak_dB = _ratio_dB(pair.strike.peak_estimate_N, pair.release.peak_N)
        self._offs.append((peak_dB, _ratio_dB(pair.strike.impulse_N_s, pair.release.impulse_N_s)))


def sentence(report: Report | None) -> str:
    """Sentence for a technician."""
    if report is None:
        return "Strikes against contacts: no contact was heard from beginning to end yet."
    contacts = "contact" if report.contacts == 1 else f"{report.contacts} contacts"
    verdict = (
        "" if report.is_good else " The sound is not what the stick does: does the scene describe this hand?"
    )
    return (
        f"Strikes against contacts, the last {contacts}: peak force announced {report.peak.words}, "
        f"impulse {report.impulse.words}.{verdict}"
    )
