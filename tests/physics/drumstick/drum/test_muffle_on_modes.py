"""One muffle on a mesh and on a bank of modes: the lowest modes fall alike, by the whole and by theory."""

import dataclasses
import math

import numpy as np
import pytest
from scipy import integrate
from scipy.special import jv

from drumstick.drum.effects.muffle import MuffleTable
from drumstick.drum.membrane.lattice import J01
from drumstick.drum.memory.strikes import OfflineStrike
from drumstick.drum.render import render
from drumstick.parameters.drum import Drum, Listen, Mesh, Modal
from drumstick.parameters.scene import Scene

RATE = 48_000
F01_HZ, OWN_T60_S, PATCH_T60_S = 200.0, 2.0, 0.4
ZEROS = {(0, 1): J01, (1, 1): 3.8317, (2, 1): 5.1356, (0, 2): 5.5201, (3, 1): 6.3802}


def _t60_s(scene: Scene, angle: float) -> dict[tuple[int, int], float]:
    # Struck and heard along the line to the patch: of each pair the one that the patch damps more.
    cosine, sine = math.cos(angle), math.sin(angle)
    scene = dataclasses.replace(scene, listen=Listen(pickups=((-0.55 * cosine, -0.55 * sine, 0.0),)))
    sound = render(scene, [OfflineStrike(0.0, 0.3 * cosine, 0.3 * sine, 1.0, 0.001)], 0.8, RATE)[:, 0]
    length, found = round(0.25 * RATE), dict[tuple[int, int], float]()
    t = np.arange(length) / RATE
    for mode, zero in ZEROS.items():
        near = F01_HZ * zero / J01 * 2.0 ** (np.arange(-20, 21) / 1200.0)
        carriers = np.exp(-2j * math.pi * np.outer(near, t)) * np.hanning(length)
        first, second = (
            np.abs(carriers @ sound[at : at + length].astype(float)).max() for at in (4800, 4800 + length)
        )
        found[mode] = 60.0 * length / RATE / (20.0 * math.log10(first / second))
    return found


def _expected_s(mode: tuple[int, int], radius: float, at: float) -> float:
    # By the integral of phi^2 over the patch, whose middle lies on the x axis.
    order, zero = mode[0], ZEROS[mode]

    def squared(b: float, a: float) -> float:
        x = at + a * math.cos(b)
        y = a * math.sin(b)
        phi = jv(order, zero * math.hypot(x, y)) * math.cos(order * math.atan2(y, x))
        return float(phi * phi * a)

    under = integrate.dblquad(squared, 0.0, radius, 0.0, 2.0 * math.pi, epsabs=1e-7)[0]
    norm = math.pi * float(jv(order + 1, zero)) ** 2 * (1.0 if order == 0 else 0.5)
    return 1.0 / (1.0 / OWN_T60_S + under / norm / PATCH_T60_S)


@pytest.mark.parametrize("angle", [0.0, 1.0])
@pytest.mark.parametrize(("at", "radius"), [(0.65, 0.2), (0.0, 0.25)])
def test_mesh_and_bank_fall_alike_under_one_muffle(angle: float, at: float, radius: float) -> None:
    patch = (at * math.cos(angle), at * math.sin(angle), radius)
    drum = Drum(f01_Hz=F01_HZ, t60_s=OWN_T60_S, effects={"muffle": MuffleTable((patch,), PATCH_T60_S, 1.0)})
    mesh = Scene("mesh", drum=drum, mesh=Mesh(rate_Hz=24_000.0))
    on_mesh, on_modes = _t60_s(mesh, angle), _t60_s(dataclasses.replace(mesh, modal=Modal(3000.0)), angle)
    for mode in ZEROS:
        assert on_modes[mode] == pytest.approx(_expected_s(mode, radius, at), rel=0.02), mode
        assert on_modes[mode] == pytest.approx(on_mesh[mode], rel=0.05), mode
    assert min(on_modes.values()) < 0.7 * OWN_T60_S
