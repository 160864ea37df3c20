"""One port through a stand-in of the library: found by a part of its name, lost, found again, notes ended."""

import pytest

from haptic_server.gateway.midi.carrier import VIRTUAL, Carrier, Report


class FakeOutput:
    """Stand-in of rtmidi2.MidiOut, as far as the carrier uses it."""

    def __init__(self, system: "FakeSystem") -> None:
        self._system = system
        self.opened: str | None = None

    @property
    def ports(self) -> list[str]:
        if self._system.is_broken:
            raise RuntimeError("the driver says no")
        return list(self._system.ports)

    def open_port(self, port: int) -> None:
        assert self.opened is None
        self.opened = self._system.ports[port]
        self._system.holder = self

    def open_virtual_port(self, port_name: str) -> None:
        self.opened = f"virtual {port_name}"
        self._system.holder = self

    def send_raw(self, *message: int) -> None:
        if self._system.is_broken:
            raise RuntimeError("the driver says no")
        assert self.opened is not None
        self._system.sent.append(message)

    def close_port(self) -> None:
        self.opened = None
        self._system.holder = None


class FakeSystem:
    def __init__(self, *ports: str) -> None:
        self.ports = list(ports)
        self.sent: list[tuple[int, ...]] = []
        self.holder: FakeOutput | None = None
        self.is_broken = False


class FakeLibrary:
    def __init__(self, *systems: FakeSystem) -> None:
        self.systems = list(systems)

    def outputs(self) -> list[FakeOutput]:
        return [FakeOutput(system) for system in self.systems]


def test_a_port_is_found_by_a_part_of_its_name_in_any_system() -> None:
    alsa, jack = FakeSystem("Midi Through:0", "Synth A"), FakeSystem("system:midi", "SYNTH B")
    carrier = Carrier("synth b", "drumstick", FakeLibrary(alsa, jack).outputs)
    assert carrier.poll() == Report(True, "strikes go to SYNTH B")
    assert carrier.poll() is None
    assert alsa.holder is None
    assert jack.holder is not None
    assert jack.holder.opened == "SYNTH B"
    assert carrier.send(b"\x99\x26\x40") is None
    assert jack.sent == [(0x99, 38, 64)]


def test_what_there_is_is_told_when_the_port_is_not() -> None:
    carrier = Carrier(
        "synth", "drumstick", FakeLibrary(FakeSystem("one", "two"), FakeSystem("three")).outputs
    )
    report = carrier.poll()
    assert report is not None
    assert not report.open
    assert "one, two, three" in report.words
    assert carrier.send(b"\x99\x26\x40") is None


def test_a_machine_without_midi_is_told() -> None:
    report = Carrier("synth", "drumstick", FakeLibrary().outputs).poll()
    assert report is not None
    assert "no MIDI system" in report.words


def test_a_port_that_goes_is_taken_again_when_it_is_back() -> None:
    system = FakeSystem("Synth")
    carrier = Carrier("synth", "drumstick", FakeLibrary(system).outputs)
    assert carrier.poll() is not None
    for _ in range(3):
        system.ports.clear()
        assert carrier.poll() == Report(False, "Synth is away; waiting for it")
        assert system.holder is None
        waiting = carrier.poll()
        assert waiting is not None
        assert waiting == carrier.poll()
        system.ports.append("Synth")
        assert carrier.poll() == Report(True, "strikes go to Synth")


def test_a_driver_that_fails_is_told_and_tried_again() -> None:
    system = FakeSystem("Synth")
    carrier = Carrier("synth", "drumstick", FakeLibrary(system).outputs)
    carrier.poll()
    system.is_broken = True
    report = carrier.send(b"\x99\x26\x40")
    assert report == Report(False, "Synth: the driver says no; trying again")
    assert carrier.poll() == Report(False, "Synth: the driver says no; trying again")
    system.is_broken = False
    assert carrier.poll() == Report(True, "strikes go to Synth")


def test_a_virtual_port_has_the_clients_name_and_stays() -> None:
    system = FakeSystem()
    carrier = Carrier(VIRTUAL, "drumstick main", FakeLibrary(system).outputs)
    assert carrier.poll() == Report(True, "strikes go to drumstick main")
    assert carrier.poll() is None
    assert system.holder is not None
    assert system.holder.opened == "virtual drumstick main"


@pytest.mark.parametrize("ended", [b"\x99\x26\x00", b"\x89\x26\x40"])
def test_silence_ends_what_sounds_and_nothing_that_has_ended(ended: bytes) -> None:
    system = FakeSystem("Synth")
    carrier = Carrier("synth", "drumstick", FakeLibrary(system).outputs)
    carrier.poll()
    for message in (b"\x99\x26\x40", b"\x99\x28\x40", ended, b"\x90\x00\x01", b"\xb1\x10\x40"):
        carrier.send(message)
    system.sent.clear()
    carrier.silence()
    assert system.holder is not None
    carrier.close()
    assert system.sent == [
        (0x80, 0, 64), (0x89, 40, 64), (0xB0, 123, 0), (0xB1, 123, 0), (0xB9, 123, 0),
    ]  # fmt: skip
    assert system.holder is None
