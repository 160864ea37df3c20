"""Writes docs/hard-cases.md from the catalogue and from the tests that are tied to it: drumstick lab hard-cases-page."""

import sys
from types import ModuleType

from drumstick_lab.checkout import DOCS, TESTS

PAGE = DOCS / "hard-cases.md"
_TESTS = TESTS

_TITLES = {
    "stick": "Stick",
    "servo": "Servo",
    "mesh": "Mesh",
    "effects": "Effects of the drum",
    "wire": "Wire",
}


def _catalogue() -> ModuleType:
    if str(_TESTS) not in sys.path:  # as pytest puts it there
        sys.path.insert(0, str(_TESTS))
    from stability import catalogue

    return catalogue


def _test(tie, halves: tuple[str, ...]) -> str:
    only = "" if set(tie.halves) == set(halves) else f" ({', '.join(tie.halves)})"
    return f"[`{tie.test}`](../tests/{tie.path.as_posix()}){only}"


def _rows(catalogue: ModuleType, subject: str) -> list[str]:
    tests: dict[str, list[str]] = {}
    for tie in catalogue.ties():
        tests.setdefault(tie.case, []).append(_test(tie, catalogue.HALVES))
    rows = [
        "| case | why it is hard | a naive method | ours | the tests' bounds | shown by |",
        "|---|---|---|---|---|---|",
    ]
    rows += [
        f"| **{case.name}** | {case.hard} | {case.naive} | {case.ours} | {case.bound} | {', '.join(tests[case.name])} |"
        for case in catalogue.CASES
        if case.of == subject
    ]
    return rows


def page() -> str:
    """The whole page."""
    catalogue = _catalogue()
    lines = [
        "# Hard cases",
        "",
        "Made by `drumstick lab hard-cases-page` from `tests/stability`; do not edit. What breaks a stick, a servo, a mesh, its effects and a",
        "wire that are written as one would write them first, and what becomes of it here. Every row is shown by a test that runs both: the",
        "naive method must fail as it is said, ours must hold. A new hard case is a row in `tests/stability/cases` and a test with `@shows`;",
        "`pytest -m shows` runs them all.",
        "",
        "Symbols: T is the period of a tick or a step; m, K_coll, R_in, z_ss, dv and tau as in [stick.md](stick.md). In the mesh tau = 4 (c T/h)^2, h the",
        "spacing; u- and u+ are the heights a step before and after, rho and eta the losses, q the squared frequency of a mode per step.",
        "",
    ]
    for subject in catalogue.SUBJECTS:
        lines += [f"## {_TITLES[subject]}", "", *_rows(catalogue, subject), ""]
    return "\n".join(lines)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
