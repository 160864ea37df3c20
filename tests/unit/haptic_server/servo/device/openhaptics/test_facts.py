"""Facts that the device tells: units, the paper's frame, the driver's own protection as read back, and the rates."""

import numpy as np
import pytest

from haptic_server.records import READING
from haptic_server.servo.device.openhaptics import facts, frame, protection, rates
from haptic_server.servo.device.openhaptics.driver import names
from haptic_server.servo.device.protocol import DeviceError
from hd_stand_in import CENTRE_MM, StandIn


@pytest.fixture
def opened(arm: StandIn) -> StandIn:
    arm.hd.init_device(None)
    return arm


needs_compiler = pytest.mark.needs("cc")


@needs_compiler
def test_the_specification_is_in_the_papers_frame_and_si_units(opened: StandIn) -> None:
    told = facts.read(opened.hd)
    specification = told.specification
    assert specification.name == "PHANTOM Premium 1.5"
    assert specification.workspace_m == pytest.approx((0.381, 0.191, 0.267))  # width, depth, height
    assert told.centre_mm == CENTRE_MM
    assert (specification.max_force_N, specification.continuous_force_N) == (8.5, 1.4)
    assert specification.stiffness_N_per_m == 3500.0
    assert specification.damping_N_s_per_m == pytest.approx(3.0)
    assert specification.resolution_m == 3e-5
    assert any("serial number 12345" in words for words in told.words)


@pytest.mark.parametrize(("told", "taken"), [(3.5, 3500.0), (0.5, 500.0), (20.0, 20000.0), (1000.0, 1000.0)])
def test_a_stiffness_per_millimetre_is_told_from_one_per_metre(told: float, taken: float) -> None:
    assert facts.in_si(told, 20.0) == pytest.approx(taken)


@needs_compiler
def test_how_a_number_was_taken_is_said(opened: StandIn) -> None:
    opened.sim("stiffness", 2300.0)
    told = facts.read(opened.hd)
    assert told.specification.stiffness_N_per_m == 2300.0
    assert "nominal stiffness 2300 as the driver tells it, taken as 2300 N/m" in told.words


@needs_compiler
@pytest.mark.parametrize("nonsense", [float("nan"), -1.0, 0.0, float("inf")])
def test_a_stiffness_that_makes_no_sense_becomes_the_softest(opened: StandIn, nonsense: float) -> None:
    opened.sim("stiffness", nonsense)
    assert facts.read(opened.hd).specification.stiffness_N_per_m == 1000.0


@needs_compiler
def test_a_device_that_is_gone_is_an_error(arm: StandIn) -> None:
    with pytest.raises(DeviceError, match="no nominal maximum force"):
        facts.read(arm.hd)


def test_the_devices_y_is_the_papers_z() -> None:
    reading = np.zeros(1, READING)
    frame.to_paper(np.array([10.0, 63.5, 40.0]), np.array(CENTRE_MM), reading[0])
    assert (reading["x_m"][0], reading["y_m"][0], reading["z_m"][0]) == pytest.approx((0.01, -0.04, 0.01))
    force = np.full(3, 9.0)
    frame.to_device(2.5, force)
    assert force.tolist() == [0.0, 2.5, 0.0]


@needs_compiler
def test_every_protection_is_on_and_read_back(opened: StandIn) -> None:
    assert protection.protect(opened.hd) == []
    for capability in (names.MAX_FORCE_CLAMPING, names.FORCE_RAMPING, names.SOFTWARE_FORCE_LIMIT):
        assert opened.hd.is_enabled(capability)
    assert not opened.hd.is_enabled(names.FORCE_OUTPUT)


@needs_compiler
def test_a_protection_that_does_not_come_on_is_said(opened: StandIn) -> None:
    opened.sim("stuck", names.FORCE_RAMPING)
    assert protection.protect(opened.hd) == ["force ramping could not be switched on"]


@needs_compiler
def test_force_output_that_does_not_come_on_is_an_error(opened: StandIn) -> None:
    opened.sim("stuck", names.FORCE_OUTPUT)
    with pytest.raises(DeviceError, match="could not be switched on"):
        protection.output_force(opened.hd, True)


@needs_compiler
def test_the_software_limits_are_in_si_units(opened: StandIn) -> None:
    limits = protection.limits(opened.hd)
    assert limits == pytest.approx((0.8, 400.0, 3.0))
    assert "0.8 m/s, 400 N/s in force" in limits.words()


def test_the_rates_are_those_of_the_bus() -> None:
    slow, fast = (500, 533, 571, 615, 667, 727, 800), (889, 1000, 1143, 1333, 1600, 2000)
    assert slow + fast == rates.FIREWIRE_RATES_HZ
    assert set(rates.CARD_RATES_HZ) <= set(rates.FIREWIRE_RATES_HZ)


def test_a_refusal_names_rates_that_there_are() -> None:
    assert "near yours 889, 1000, 1143" in rates.refusal(1100)


@needs_compiler
@pytest.mark.parametrize(
    ("bus", "taken"), [(0, {500, 1000, 2000}), (1, set(rates.FIREWIRE_RATES_HZ)), (2, set())]
)
def test_the_driver_has_the_last_word_on_rates(opened: StandIn, bus: int, taken: set[int]) -> None:
    opened.sim("bus", bus)
    found: set[int] = set()
    for rate in {*rates.FIREWIRE_RATES_HZ, 1001, 1500, 4000}:
        opened.hd.set_rate(rate)
        if not opened.hd.errors():
            found.add(rate)
    assert found == taken
