"""First table of docs/accuracy-and-time.md: whole set-ups, each by what it costs, how late it is and how far off. Pure.

Rows are those of the whole way (drumstick_lab.accuracy.whole) with those of the wire. Errors of message and drum are
added as if neither knew of the other, sqrt(a^2 + b^2): no set-up was measured from end to end. Of several playings on
one drum each column has its own largest value.
"""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

from drumstick_lab.accuracy import wire
from drumstick_lab.accuracy.whole import MIDDLE_Hz

Row = dict[str, Any]
_MIDDLE = f"spectrum below {MIDDLE_Hz / 1e3:g} kHz"
COLUMNS = (_MIDDLE, "spectrum")
HEAD = (
    "you play", "you type", "share of one processor core: all (drum alone)", "delay from strike to sound card ± spread",
    "sounds up to", "differs from the best drum we can compute: below 4 kHz", "in all bands",
)  # fmt: skip
_ON_STAGE = ("roll", "accents")


def digits(value: float) -> str:
    """Two digits, and no power of ten where a person would write none."""
    return f"{value:.0f}" if 10.0 <= abs(value) < 1e5 else f"{value:.2g}"


def row_of(rows: list[Row], stage: str, playing: str, choice: str) -> Row:
    """The first row of this stage whose playing and choice begin so. StopIteration when there is none."""
    return next(
        row
        for row in rows
        if row["stage"] == stage and row["playing"].startswith(playing) and row["choice"].startswith(choice)
    )


def measure_of(row: Row, what: str) -> Row:
    """One measure of a row: its value, unit and JNDs. StopIteration when the row has it not."""
    return next(each for each in row["measures"] if each["what"] == what)


class Off(NamedTuple):
    """Error of something, dB, and how far off what it is compared with may be itself."""

    dB: float
    own_dB: float

    def is_told_from(self, other: "Off") -> bool:
        """True when both differ by more than what they are compared with may be off."""
        return abs(self.dB - other.dB) > max(self.own_dB, other.own_dB)


class SetUp(NamedTuple):
    """One line: words, rows of servo, message, wire, and of drum and its reference by playing."""

    play: str
    typed: str
    arm: Row
    message: Row
    onset: Row
    drums: list[Row]
    references: list[Row]
    beside: int | None = None  # number of the line that it is told from
    more_share: float = 0.0
    more_late: str = ""

    @property
    def drum_share(self) -> float:
        """Share of a core that the drum takes, at most."""
        return max(row["share_of_core"] for row in self.drums)

    def off(self, what: str) -> Off:
        """Error of message and drum in one column."""
        drum, own = (
            max(measure_of(row, what)["value"] for row in rows) for rows in (self.drums, self.references)
        )
        return Off(math.hypot(drum, measure_of(self.message, what)["value"]), own)

    @property
    def top_Hz(self) -> float:  # noqa: N802
        """Highest frequency of the drum: half the rate of a mesh, the top of a bank."""
        rate_Hz = float(self.drums[0]["choice"].removesuffix(" Hz").split()[-1])
        return rate_Hz if self.drums[0]["choice"].startswith("bank") else 0.5 * rate_Hz


def set_ups(rows: list[Row], mallet_share: float) -> list[SetUp]:
    """Lines of the table. mallet_share: of a core, what a timpano took more while it was played than while it rang."""
    arm, fast_arm = (
        row_of(rows, "servo", "a fall, the arm in time", f"{rate} Hz, predictor lead")
        for rate in (1000, 4000)
    )
    blow, press = (row_of(rows, "message", playing, "analytic") for playing in ("a blow of", "a press"))
    stream = row_of(rows, "message", "a press", "streamed, 4000")
    felt = row_of(rows, "message", "a blow by a felt", "mallet")
    soon, even, _, streamed = (row for row in rows if row["playing"] == wire.TO_SOUND)

    def made(
        play: str,
        typed: str,
        tier: str,
        of: tuple[str, ...],
        sent: Row = blow,
        onset: Row = soon,
        **more: Any,
    ) -> SetUp:
        drums = [row_of(rows, "drum", playing, tier) for playing in of]
        references = [row_of(rows, "reference", playing, "") for playing in of]
        return SetUp(play, typed, more.pop("arm", arm), sent, onset, drums, references, **more)

    draft, fine = '`mesh.accuracy = "draft"`', '`mesh.accuracy = "fine"`'
    own, snare = "`mesh.rate_Hz = 0`", ("snare",)
    return [
        made("rolls, strikes, accents on stage", "nothing: the default", "standard", _ON_STAGE),
        made(
            "rolls that must be as even as can be", f"`drum.latency_s = {even['latency_s']:g}`",
            "standard", _ON_STAGE, onset=even,
        ),
        made("rolls on an older machine", draft, "draft", _ON_STAGE, beside=0),
        made("rolls that are recorded, or heard alone", fine, "fine", _ON_STAGE, beside=0),
        made("a snare on stage", own, "standard", snare),
        made("a snare on an older machine", f"{own}, {draft}", "draft", snare, beside=4),
        made("a snare that is recorded", f"{own}, {fine}", "fine", snare, beside=4),
        made(
            "timpani", "nothing: scene `timpani` has `[modal]`", "bank to 5000", ("timpani",), felt,
            more_share=max(mallet_share - felt["share_of_core"], 0.0),
        ),
        made("press rolls and buzz", "nothing: the default", "standard", ("press",), press),
        made(
            "press rolls, where it must be heard how hard the hand presses",
            '`drum.excitation = "streamed"`, `servo.rate_Hz = 4000`',
            "standard", ("press",), stream, streamed, arm=fast_arm, more_late=", computed",
        ),
    ]  # fmt: skip


def _off(line: SetUp, lines: list[SetUp], what: str) -> str:
    off = line.off(what)
    if line.beside is not None and not off.is_told_from(lines[line.beside].off(what)):
        return "not to be told apart"
    return f"{digits(off.dB)} ± {digits(off.own_dB)} dB"


def table(lines: list[SetUp], gateway_share: float) -> Iterator[str]:
    """Lines of the table in Markdown. gateway_share: of a core, added to each."""
    yield f"| {' | '.join(HEAD)} |"
    yield "|---" * len(HEAD) + "|"
    for line in lines:
        parts = [line.arm["share_of_core"], gateway_share, line.drum_share, line.more_share]
        parts.append(line.message["share_of_core"])
        spread = measure_of(line.onset, "spread of the onset")["value"]
        cells = (
            line.play, line.typed,
            f"{100.0 * sum(parts):.1f} % ({digits(100.0 * line.drum_share)} %)",
            f"{line.onset['latency_ms']:.1f} ms ± {spread:.1f}{line.more_late}",
            f"{1e-3 * line.top_Hz:g} kHz",
            *(_off(line, lines, what) for what in COLUMNS),
        )  # fmt: skip
        yield f"| {' | '.join(cells)} |"
