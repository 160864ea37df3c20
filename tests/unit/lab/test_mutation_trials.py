"""What a mutant that was ended in mid-trial left behind is gone before the next one."""

from pathlib import Path

from drumstick_lab.benchmarks.mutants.mutation_trials import Copy


def test_the_next_mutant_begins_with_the_true_source_and_without_the_last_one_s_kernels(
    tmp_path: Path,
) -> None:
    for folder, text in (("tree", "x = 2\n"), ("aside", "x = 1\n"), ("mutant", "kernels")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "a.py").write_text(text)
    Copy(tmp_path).restore()
    assert (tmp_path / "tree" / "a.py").read_text() == "x = 1\n"
    assert [path.name for path in tmp_path.iterdir()] == ["tree"]
