"""The sentence beside gcc's table says what the rows say."""

from drumstick_lab.measuring.stored import read
from drumstick_lab.pages.measured import mesh_page


def _rows(**ratios: float) -> list[dict[str, float]]:
    return [{"across": int(name[1:]), "gcc_over_ours": ratio} for name, ratio in ratios.items()]


def test_the_aim_beside_gcc_is_told_with_what_misses_it() -> None:
    missed = mesh_page.aim(_rows(n16=1.0, n32=1.49, n64=1.5, n128=1.2), 8)
    assert missed.endswith("With AVX2 it is missed at 32 across (1.49) and 128 across (1.20).")
    assert mesh_page.aim(_rows(n16=1.0, n32=1.6), 16).endswith("With AVX-512 it is met at all of them.")


def test_the_goals_beside_other_instruments_are_told_with_what_misses_them() -> None:
    times = {f"ours N = {across}": {"STK": {"median": ratio}} for across, ratio in ((32, 8.2), (64, 7.94))}
    result = {"goals": {"ours": {"STK": 8.0}}, "times_ours": times | {"ours AVX2 N = 32": {}}}
    assert mesh_page.peers_goals(result) == [
        "The goals of `ours` are STK 8 times its cost: missed by STK at 64 across (7.9)."
    ]
    result["times_ours"] = {"ours N = 32": {"STK": {"median": 8.0}}}
    assert mesh_page.peers_goals(result) == [
        "The goals of `ours` are STK 8 times its cost: met at every size."
    ]


def test_the_page_has_it_of_the_stored_rows() -> None:
    stored = read("mesh_kernel")
    assert mesh_page.aim(stored["kernels"], stored["lanes"]) in mesh_page.page().splitlines()
