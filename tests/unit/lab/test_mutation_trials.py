"""The next mutant begins without anything of one that was ended in mid-trial."""

from pathlib import Path

from drumstick_lab.benchmarks.mutants.mutation_trials import Copy


def test_the_source_is_the_true_one_and_the_kernels_are_gone(
    tmp_path: Path,
) -> None:
    for folder, text in (("tree", "x = 2\n"), ("aside", "x = 1\n"), ("mutant", "kernels")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "a.py").write_text(text)
    Copy(tmp_path).restore()
    assert (tmp_path / "tree" / "a.py").read_text() == "x = 1\n"
    assert [path.name for path in tmp_path.iterdir()] == ["tree"]
