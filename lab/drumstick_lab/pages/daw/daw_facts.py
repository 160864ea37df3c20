"""Facts in the files under docs/daw/files, taken from the code: addresses, ports, faders, the note.

A fader travels as far as the panel's slider does: around the value of the scene `roll`, within the table's range.
"""

from dataclasses import dataclass

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import Parameter, table_of, values_of
from drumstick.stick.law import law_of
from protocol import osc
from rig.supervision.plan import Options
from web_panel.tuning.slider_range import SliderRange, range_around

PREFIX = osc.DEFAULT_PREFIX
HOST, PORT_IN = osc.DEFAULT_IN  # where the rig hears
PORT_OUT = osc.DEFAULT_OUT[1]  # where it sends to
FADERS = ("dv_pls", "k_coll")  # the two that the paper's technician tunes
NOTE, CHANNEL = Options.midi_note, Options.midi_channel  # as `--midi-out` has them
_SCENE = parse(shipped_text("roll"), "roll")
F01_HZ = _SCENE.drum.f01_Hz


@dataclass(frozen=True)
class Fader:
    """One parameter on a surface: from `low` to `high`, SI units; `start` is the scene's value."""

    row: Parameter
    travel: SliderRange
    start: float

    @property
    def name(self) -> str:
        """The wire name."""
        return self.row.name

    @property
    def unit(self) -> str:
        """SI, as the table says it."""
        return self.row.quantity.unit

    @property
    def label(self) -> str:
        """Name and unit."""
        return f"{self.name} ({self.unit})"

    @property
    def address(self) -> str:
        """Address to which its value goes, and from which it comes back."""
        return heard(osc.SET, self.name)

    @property
    def norm_address(self) -> str:
        """Address of its 0..1 form."""
        return heard(osc.SET_NORM, self.name)

    @property
    def norms(self) -> tuple[float, float]:
        """The ends of the travel in the 0..1 form, rounded inwards by less than a thousandth of the way."""
        low, high = (self.row.norm(end) for end in (self.travel.low, self.travel.high))
        return round(low + 5e-7, 6) if low > 0.0 else 0.0, round(high - 5e-7, 6) if high < 1.0 else 1.0


def sent(row: osc.Sent, name: str = "") -> str:
    """The whole address of what the rig sends."""
    return osc.address(PREFIX, row, name)


def heard(row: osc.Incoming, name: str = "") -> str:
    """The whole address of what the rig hears."""
    return osc.address(PREFIX, row, name)


def faders() -> tuple[Fader, ...]:
    """The faders of every surface, in order."""
    table = table_of(_SCENE)
    values = values_of(law_of(_SCENE), table)
    return tuple(
        Fader(table[name], range_around(table[name].quantity, values[name]), values[name]) for name in FADERS
    )


def words() -> dict[str, str]:
    """Words that a template may name as <<NAME>>."""
    found = {
        f"SENT{row.path.replace('/', '_').upper()}": sent(row) for row in osc.SENT if "NAME" not in row.path
    }
    found |= {
        f"HEARD{row.path.replace('/', '_').upper()}": heard(row)
        for row in osc.INCOMING
        if "NAME" not in row.path
    }
    found |= {f"TYPES{row.path.replace('/', '_').upper()}": row.types for row in osc.SENT}
    found |= {
        "PARAM": heard(osc.SET, ""),
        "HOST": HOST,
        "PORT_IN": str(PORT_IN),
        "PORT_OUT": str(PORT_OUT),
        "NOTE": str(NOTE),
        "CHANNEL": str(CHANNEL),
        "F01_HZ": f"{F01_HZ:g}",
    }
    return found
