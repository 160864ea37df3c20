"""The head in closed form is that of the equation of motion, and the drums that play come near to it."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import drumstick as ds
from drumstick.drum.calibrate import strike_for_speed
from drumstick.drum.effects.registry import DRUM_TABLES
from drumstick.drum.render import render
from drumstick.parameters.drum import Mesh, Modal
from drumstick.parameters.scene import Scene
from drumstick.perception.erb import spectral_distance
from drumstick_lab.accuracy.exact import scene as beside
from drumstick_lab.accuracy.exact.differences import levelled
from drumstick_lab.accuracy.exact.head import Blow, Contact, blow, head, velocity

RATE_Hz = 48_000
CONTACT = Contact(43.3, 40.0, True)


def force(of: Blow, t_s: np.ndarray) -> np.ndarray:
    since = t_s - of.t_s
    wave = 2.0 * (of.size * np.exp(of.growth * since)).real
    return np.where((since >= 0.0) & (since < of.lasts_s), wave, 0.0)


def test_the_lowest_modes_are_those_of_the_handbook() -> None:
    """Ratios 1, 1.593, 2.136, 2.295, 2.653, 2.917; T60 as asked at two pitches."""
    found = head(150.0, 1.2, 1000.0)
    assert found.f_Hz[:6] / found.f_Hz[0] == pytest.approx([1.0, 1.593, 2.136, 2.295, 2.653, 2.917], abs=1e-3)
    assert found.f_Hz[0] == pytest.approx(150.0, rel=1e-12)
    assert found.t60_s == pytest.approx(np.full(len(found.zeros), 1.2))
    lossy = head(150.0, 1.2, 4000.0, (0.15, 2000.0))
    near = int(np.argmin(np.abs(lossy.f_Hz - 2000.0)))
    assert lossy.t60_s[0] == pytest.approx(1.2)
    assert lossy.t60_s[near] == pytest.approx(0.15, rel=0.02)


@pytest.mark.parametrize("contact", [CONTACT, CONTACT._replace(pulls=False)])
def test_a_blow_has_its_impulse_and_ends_as_its_law_says(contact: Contact) -> None:
    struck = blow(0.0, (0.5, 0.0), 0.004, 0.006, contact)
    t_s = np.linspace(0.0, 0.004, 200_001)[:-1]
    assert force(struck, t_s).mean() * 0.004 == pytest.approx(0.006, rel=1e-4)
    peak, last = force(struck, t_s).max(), force(struck, t_s)[-1]
    assert abs(last) < 1e-3 * peak if not contact.pulls else last < -1e-2 * peak


def test_two_blows_that_overlap_move_the_head_as_the_equation_of_motion_does() -> None:
    """Each mode by another program: q'' + 2 sigma q' + w0^2 q = F shape / norm."""
    of = head(150.0, 0.3, 450.0, (0.1, 400.0))
    first = blow(0.001, (0.5, 0.1), 0.004, 0.006, CONTACT)
    second = blow(0.003, (-0.2, 0.6), 0.005, 0.004, CONTACT._replace(pulls=False))
    heard = velocity(of, [second, first], [(0.7, (-0.45, 0.3)), (0.4, (0.5, 0.25))], 0.02, RATE_Hz)
    from scipy.special import jv

    def shape(at: int, x: float, y: float) -> complex:
        m = int(of.orders[at])
        return complex(jv(m, of.zeros[at] * math.hypot(x, y)) * np.exp(1j * m * math.atan2(y, x)))

    t_s, due = np.arange(960) / RATE_Hz, np.zeros(960)
    for at, pole in enumerate(of.poles):

        def motion(t: float, y: np.ndarray, at: int = at, pole: complex = pole) -> np.ndarray:
            push = sum(shape(at, *each.place) * force(each, np.array([t]))[0] for each in (first, second))
            return np.array(
                [y[1], 2.0 * pole.real * y[1] - abs(pole) ** 2 * y[0] + push * of.inverse_norms[at]]
            )

        solved = solve_ivp(motion, (0.0, t_s[-1]), np.zeros(2, complex), t_eval=t_s, max_step=1e-4)
        for gain, (x, y) in ((0.7, (-0.45, 0.3)), (0.4, (0.5, 0.25))):
            due += gain * (solved.y[1] * np.conj(shape(at, x, y))).real
    assert heard == pytest.approx(due, abs=2e-3 * np.abs(due).max())


@pytest.fixture
def _low(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(beside, "TOP_Hz", 3000.0)


@pytest.mark.usefixtures("_low")
def test_a_bank_of_modes_and_a_mesh_come_near_to_it() -> None:
    scene = dataclasses.replace(ds.scene("roll"), modal=Modal(top_Hz=3000.0))
    strikes = [strike_for_speed(scene, 1.0, 0.5, 0.0, 0.01)]
    wanted = beside.sound(scene, strikes, 0.3, RATE_Hz)

    def off_dB(played: Scene) -> float:  # noqa: N802
        heard = render(played, strikes, 0.3, RATE_Hz)[:, 0]
        return spectral_distance(heard, levelled(wanted, heard), RATE_Hz, 2500.0)

    assert off_dB(scene) < 0.5
    fine, coarse = (
        dataclasses.replace(scene, modal=None, mesh=Mesh(rate_Hz=rate_Hz)) for rate_Hz in (24e3, 8e3)
    )
    assert off_dB(fine) < off_dB(coarse)


@pytest.mark.usefixtures("_low")
def test_a_mesh_out_of_tune_is_told_mode_by_mode() -> None:
    scene = ds.scene("roll")
    sharp = dataclasses.replace(scene.drum, f01_Hz=150.0 * 2.0 ** (1.0 / 1200.0), t60_s=1.18)
    exact = dataclasses.replace(scene, modal=Modal(top_Hz=1500.0))
    for drum, due_cents, due in ((scene.drum, 0.0, 0.0), (sharp, 1.0, 1.18 / 1.2 - 1.0)):
        played = dataclasses.replace(exact, drum=drum)
        _, cents, decays = beside.mode_errors(scene, played, 1.2, RATE_Hz)
        assert cents == pytest.approx(np.full(beside.MODES, due_cents), abs=0.05)
        assert decays == pytest.approx(np.full(beside.MODES, abs(due)), abs=1e-3)


@pytest.mark.usefixtures("_low")
def test_an_effect_that_is_not_solved_is_refused() -> None:
    scene = ds.scene("roll")
    cavity = dataclasses.replace(scene.drum, effects={"cavity": DRUM_TABLES["cavity"]()})
    with pytest.raises(ValueError, match="no exact head has cavity"):
        beside.head_of(dataclasses.replace(scene, drum=cavity))
    lossy = beside.with_loss(scene, DRUM_TABLES["internal_loss"]())
    assert beside.head_of(lossy).t60_s[5] < beside.head_of(scene).t60_s[5]
