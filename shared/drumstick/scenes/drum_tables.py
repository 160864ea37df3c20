"""`[drum]` as it may be written, with `[drum.effects.NAME]` below it, and `[mallet]`."""

from collections.abc import Collection, Mapping
from typing import Any, cast

from drumstick.drum.effects import head_numbers
from drumstick.drum.effects.registry import (
    DRUM_TABLES,
    FORMER_NAMES,
    MESH_EFFECTS,
    MESH_PICKUPS_ONLY,
    MODAL_EFFECTS,
    NEEDS,
)
from drumstick.parameters.drum import Drum, Listen, Mesh
from drumstick.parameters.mallet import MATERIALS, Mallet
from drumstick.parameters.pickups import pickups_off_head
from drumstick.scenes.reading import Reader, shown


def named_tables(
    reader: Reader,
    path: str,
    known: dict[str, type],
    given: object,
    former: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """The tables of effects under `path`, in the order of `known`; every mistake is noted.

    former: old name -> name in `known`. A table of an old name is read as that of the name, and a note says so.
    """
    if not isinstance(given, dict):
        reader.refuse(path, f"must hold tables such as [{path}.{next(iter(known))}], not {shown(given)}")
        return {}
    named = cast(dict[str, object], given)
    written: dict[str, str] = {}  # name -> as the text has it, or a mistake in its table would name no line
    for name in named:
        now = name if former is None else former.get(name, name)
        if now not in known:
            reader.refuse(f"{path}.{name}", f"unknown effect; known: {', '.join(known)}")
        elif now == name:
            written[now] = name
        elif now in named:
            reader.refuse(
                f"{path}.{name}", f"is the old name of {now}, which is here too: delete [{path}.{name}]"
            )
        else:
            reader.note(
                f"{path}.{name}",
                f"is called {now} now; the old name is still read for a while: rename it there",
            )
            written[now] = name
    return {
        name: reader.table(f"{path}.{written[name]}", known[name], named[written[name]])
        for name in known
        if name in written
    }


def drum_of(reader: Reader, given: object) -> Drum:
    """The table `[drum]`."""
    values = reader.values("drum", Drum, given, also_known=("effects",))
    entries = cast(dict[str, object], given) if isinstance(given, dict) else {}
    effects = named_tables(reader, "drum.effects", DRUM_TABLES, entries.get("effects", {}), FORMER_NAMES)
    return Drum(**values, effects=effects)


_LOWEST = 0.1  # radii: nearer, a single junction would be heard alone


def check_renderer(reader: Reader, drum: Drum, named: Collection[str]) -> None:
    """`named`: which of the tables `mesh` and `modal` the text has."""
    if "modal" not in named:
        for name in drum.effects:
            if name not in MESH_EFFECTS:
                reader.refuse(
                    f"drum.effects.{name}", "needs [modal]: a mesh has air on both sides, but no bowl"
                )
        return
    if "mesh" in named:
        reader.refuse("modal", "stands instead of [mesh]: a scene has one of them")
    if drum.excitation == "streamed":
        reader.refuse("drum.excitation", "needs [mesh]: [modal] is struck by strikes or mallets")
    for name in drum.effects:
        if name not in MODAL_EFFECTS:
            reader.refuse(f"drum.effects.{name}", "needs [mesh]: a bank of modes has no junctions for it")


def mallet_of(reader: Reader, given: object) -> Mallet:
    """The table `[mallet]`: the material's numbers, and in their place those that are given."""
    values = reader.values("mallet", Mallet, given)
    numbers: dict[str, Any] = {**MATERIALS[values.get("material", "wood")], **values}
    return Mallet(**numbers)


def check_mallet(reader: Reader, drum: Drum, named: Collection[str]) -> None:
    """A mallet that nothing swings."""
    if "mallet" in named and drum.excitation != "mallet":
        reader.refuse(
            "mallet",
            f'needs [drum] excitation = "mallet", and it is {shown(drum.excitation)}: set it, or leave [mallet] out',
        )


def check_mesh(reader: Reader, mesh: Mesh, named: Collection[str]) -> None:
    """Check that accuracy = "fine" can be, that "auto" has a choice, and that what it chooses is not given by hand."""
    if mesh.accuracy == "fine" and "modal" not in named:
        for key, needed in (("topology", "triangular"), ("courant", "limit")):
            if getattr(mesh, key) != needed:
                reader.refuse(
                    "mesh.accuracy",
                    f'"fine" is of fourth order, which needs mesh.{key} = "{needed}": set that, or another accuracy',
                )
    if mesh.accuracy == "auto":
        if "modal" in named:
            reader.refuse("mesh.accuracy", '"auto" is for a mesh: the scene has [modal] instead')
        for key in ("rate_Hz", "junctions_across"):
            if getattr(mesh, key) > 0.0:
                reader.refuse(f"mesh.{key}", 'is what accuracy = "auto" chooses: leave one of them out')


def check_listen(reader: Reader, listen: Listen, drum: Drum, named: Collection[str]) -> None:
    """Microphones: what their four numbers may be, and what drum can have some. Pickups that can be moved."""
    if listen.microphones and listen.pickup_places == "live":
        reader.refuse(
            "listen.pickup_places",
            '"live" is for pickups, and where there are microphones no pickup is heard: leave one of them out',
        )
    for words in pickups_off_head(listen):
        reader.refuse("listen.pickups", words)
    for name, why in MESH_PICKUPS_ONLY.items():
        if listen.microphones and "modal" not in named and name in drum.effects:
            reader.refuse("listen.microphones", f"need [modal] beside [drum.effects.{name}]: {why}")
    for at, (_, _, height, pan) in enumerate(listen.microphones, 1):
        if height < _LOWEST:
            reader.refuse(
                "listen.microphones", f"number {at} is {height:g} radii above the head, less than {_LOWEST:g}"
            )
        if abs(pan) > 1.0:
            reader.refuse("listen.microphones", f"number {at} has the pan {pan:g}, outside -1 .. 1")


def check_drum(reader: Reader, drum: Drum) -> None:
    """Check what only several values together can get wrong."""
    for name, (needed, why) in NEEDS.items():
        if name in drum.effects and needed not in drum.effects:
            reader.refuse(f"drum.effects.{name}", f"needs [drum.effects.{needed}]: {why}")
    for effect, key, words in head_numbers.mistakes(drum):
        reader.refuse(".".join(filter(None, ("drum.effects", effect, key))), words)
