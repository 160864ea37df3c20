"""Result of a soak: verdicts, JSON, words."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from drumstick_lab.soak.verdict import Verdict, all_passed


@dataclass(frozen=True)
class Result:
    """`lasted_s`: of the clock on the wall in real time, of virtual time in the virtual form."""

    form: str
    lasted_s: float
    speed: float
    strikes: int
    strikes_per_s: float
    verdicts: list[Verdict]
    counts: Mapping[str, Any] = field(default_factory=dict[str, Any])

    @property
    def passed(self) -> bool:
        """True when no quantity failed."""
        return all_passed(self.verdicts)

    def as_json(self, scene: str) -> dict[str, Any]:
        """One plain object, machine included."""
        from drumstick_lab.measuring.stored import of_this_run

        return {
            "machine": of_this_run("soak"),
            "form": self.form,
            "scene": scene,
            "speed": self.speed,
            "duration_s": round(self.lasted_s, 1),
            "strikes": self.strikes,
            "strikes_per_s": round(self.strikes_per_s, 2),
            "passed": self.passed,
            "quantities": [verdict.as_json() for verdict in self.verdicts],
            "counts": dict(self.counts),
        }

    def in_words(self) -> str:
        """One line for each quantity; those that failed first."""
        order = sorted(self.verdicts, key=lambda verdict: verdict.passed is not False)
        width = max(len(verdict.name) for verdict in order)
        lines = [
            f"{self.form}, {self.lasted_s:.0f} s, {self.strikes} strikes ({self.strikes_per_s:.1f} a second):"
            f" {'passed' if self.passed else 'FAILED'}"
        ]
        for verdict in order:
            said = {True: "pass", False: "FAIL", None: "    "}[verdict.passed]
            slope = verdict.slope
            number = f"{verdict.last:g} {verdict.unit}" if verdict.last is not None else ""
            if slope is not None:
                number = f"{slope.per_h:+.3g} {verdict.unit}/h ({slope.low:+.3g} .. {slope.high:+.3g})"
            lines.append(f"  {said}  {verdict.name:{width}s}  {number}: {verdict.words}")
        return "\n".join(lines)
