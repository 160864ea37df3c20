"""`drumstick simulate` for as long as nobody can wait, or keep in memory: refused in words."""

import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.simulate import TooLong
from drumstick.stick.simulate import simulate as run
from rig.exit_status import CommandError
from rig.offline import simulate as command
from rig.offline.simulate import simulate


def test_more_contacts_than_can_be_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """A day of a quick roll would be tens of millions of rows, and the command keeps them until the end."""
    scene = parse(shipped_text("roll"), "roll")
    with pytest.raises(TooLong, match=r"more than 2000 contacts in the first \d+"):
        run(scene, 1e7, most_contacts=2000)
    assert run(scene, 1.0, most_contacts=2000).end == "time"
    monkeypatch.setattr(command, "_MAX_CONTACTS", 2000)
    with pytest.raises(
        CommandError, match=r"--duration 1e\+07 s: more than 2000 contacts in the first .* give a shorter one"
    ):
        simulate("roll", 1e7, 0.4, "exact", None, True, as_json=True)


def test_more_steps_than_anybody_waits_for() -> None:
    with pytest.raises(
        CommandError, match=r"are 1e\+16 steps of 1e-09 s, more than 1e\+10: give a shorter --duration"
    ):
        simulate("roll", 1e7, 0.4, "rk4", 1e-9, True, as_json=True)
