"""The press roll buzzes and comes to lie; its stream keeps the force; a mallet's force is nearly that on modes."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from drumstick_lab.accuracy.drums import mallet_blow, press


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Two presses of it."""
    monkeypatch.setattr(press, "LASTS_S", 0.44)
    for cached in (press.run, press._impulse):
        cached.cache_clear()
    yield
    for cached in (press.run, press._impulse):
        cached.cache_clear()


def test_a_press_buzzes_faster_and_faster_and_then_lies_in_the_head(short: None) -> None:
    contacts = press.run().contacts
    second = contacts[contacts["t_in_s"] > 0.22]
    assert len(second) >= 5
    lasts_s, apart_s = second["t_out_s"] - second["t_in_s"], np.diff(second["t_in_s"])
    assert np.all(np.diff(apart_s) < 0.0)
    assert lasts_s[:-1].max() < 0.01
    assert lasts_s[-1] > 0.04


@pytest.mark.parametrize("rate_Hz", [1000.0, 4000.0, 192_000.0])
def test_its_stream_has_the_impulse_of_each_contact(short: None, rate_Hz: float) -> None:
    streamed = [contact.forces_N.sum() / rate_Hz for contact in press.contacts(rate_Hz)]
    assert streamed == pytest.approx(press.run().contacts["impulse_N_s"], rel=1e-3)
    assert all(contact.forces_N[-1] == 0.0 for contact in press.contacts(rate_Hz))


def test_a_rate_that_has_no_whole_ticks_here_is_refused(short: None) -> None:
    with pytest.raises(ValueError, match="does not divide"):
        press.contacts(44_100.0)


@pytest.mark.parametrize("blow", [mallet_blow.wood, mallet_blow.felt])
@pytest.mark.long
def test_a_mallets_force_on_the_drum_is_nearly_the_one_on_all_modes(
    blow: Callable[[], mallet_blow.Struck],
) -> None:
    mesh, modes = (mallet_blow.forces(blow(), by_modes) for by_modes in (False, True))
    assert mesh.max() == pytest.approx(modes.max(), rel=0.1)
    assert mesh.sum() == pytest.approx(modes.sum(), rel=0.03)
    assert np.count_nonzero(mesh) == pytest.approx(np.count_nonzero(modes), rel=0.15)
    assert mesh[-1] == modes[-1] == 0.0
