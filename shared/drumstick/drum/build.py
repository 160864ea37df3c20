"""From a scene to an engine at rest, of a mesh or of a bank of modes. Allocates; any thread."""

from typing import Any, cast

import numpy as np

from drumstick.drum.effects import head_numbers
from drumstick.drum.effects.building import Building
from drumstick.drum.effects.registry import effects_of
from drumstick.drum.engine import CONTROL, METERS, PENDING, Control, Engine
from drumstick.drum.length_unit import metres_per_unit_in_air
from drumstick.drum.mallets.mallet_memory import mallets_on_mesh, mallets_on_modes
from drumstick.drum.membrane.heads import aligned, head_of, pickups_on
from drumstick.drum.membrane.scheme import tuned
from drumstick.drum.membrane.surface import Places, on_mesh
from drumstick.drum.memory.listening import as_it_comes
from drumstick.drum.memory.pickup_fade import with_fade
from drumstick.drum.memory.pulses import CONTACT, FORCE, FORCES, POOL, PULSE
from drumstick.drum.memory.shared_sweep import shared_sweep_of
from drumstick.drum.memory.strikes import EVENT, StrikeRing
from drumstick.drum.memory.timeline import stream_of
from drumstick.drum.modal.air_on_mesh import moved_modes, pitch_on_mesh
from drumstick.drum.modal.surface import of_modes
from drumstick.drum.output.display_data import display_buffers
from drumstick.drum.output.microphones import microphones_of
from drumstick.drum.output.upsample import TAPS, interpolator
from drumstick.drum.step_numbers import control_of
from drumstick.drum.tiers import coefficients_of, divisor_for
from drumstick.parameters.scene import Scene
from drumstick.stick.contact import PAPER
from drumstick.stick.effects.registry import mean_lag_s
from drumstick.stick.law import law_of
from drumstick.stick.records import Law
from realtime.records import ABSENT, Record, Records, is_there


def _contact_of(scene: Scene, step_s: float) -> Records:
    # A head that comes too late pushes as if its damper were weaker.
    law: Law = law_of(scene)[0]
    taken = float(law["r_in"]) - float(law["k_coll"]) * mean_lag_s(scene.effects)
    per_step = step_s / (2.0 * float(law["m"]))
    contact: Records = np.zeros(1, CONTACT)
    fields: Record = contact[0]
    fields["decay"] = per_step * max(taken, 0.0)
    fields["own_decay"] = per_step * max(taken - float(law["r_out"]), 0.0)
    fields["pulls"] = int(law["release"]) == PAPER
    return contact


def _common(scene: Scene, step_s: float, divisor: int, strikes: StrikeRing, places: Places) -> dict[str, Any]:
    # What every engine has, whatever renders its head.
    return {
        "contact": _contact_of(scene, step_s),
        "meters": cast(Records, np.zeros(1, METERS)),
        "pulses": cast(Records, np.zeros(POOL, PULSE)),
        "phases": interpolator(divisor),
        "history": aligned((2, 2 * TAPS)),
        "pending": cast(Records, np.zeros(PENDING, EVENT)),
        "ring_cells": strikes.cells,
        "ring_slots": strikes.slots,
        "listening": as_it_comes(),
        "shown": display_buffers(places.places, places.shares),
    }


def _unit_m(scene: Scene) -> float:
    return metres_per_unit_in_air(scene) if head_numbers.are_in_metres(scene.drum) else 0.0


class Unplayable(ValueError):
    """No drum can be made of this scene: its effects together leave a wave no room, or scipy is missing; says why.

    >>> import drumstick as ds
    >>> issubclass(ds.Unplayable, ValueError)
    True
    """


def _of_mesh(scene: Scene, rate_Hz: int, strikes: StrikeRing) -> Engine:
    divisor = divisor_for(scene, rate_Hz)
    step_s = divisor / rate_Hz
    numbers = coefficients_of(scene, step_s)
    lattice = tuned(pitch_on_mesh(scene.drum), step_s, numbers.scheme, numbers.losses)
    moved = moved_modes(scene, lattice, numbers, step_s)
    head = head_of(lattice, numbers.weight_scale)
    size = lattice.weights.size
    pickups, pickup_gains = pickups_on(scene, head, 1.0)
    return Engine(
        **_common(scene, step_s, divisor, strikes, on_mesh(head)),
        control=control_of(numbers, scene, rate_Hz, divisor),
        head=head,
        forces=cast(Records, np.zeros(FORCES, FORCE)),
        pickups=pickups,
        pickup_gains=pickup_gains,
        microphones=microphones_of(scene, lattice, step_s) if scene.listen.microphones else ABSENT,
        laplacian=aligned((size,)) if numbers.scheme.order_4 else ABSENT,
        effects=effects_of(Building(scene, step_s, _unit_m(scene), lattice, numbers, moved)),
        stream=stream_of(scene, step_s) if scene.drum.excitation == "streamed" else ABSENT,
        mallets=mallets_on_mesh(scene, step_s, float(head.grid["spacing"][0])),
        shared_sweep=shared_sweep_of(head)
        if scene.mesh.threads > 1 and not numbers.scheme.order_4
        else ABSENT,
    )


def _of_modes(scene: Scene, rate_Hz: int, strikes: StrikeRing) -> Engine:
    from drumstick.drum.modal.building import bank_of, blocks_for, divisor_below, highest_zero

    divisor = divisor_below(scene, rate_Hz)
    step_s = divisor / rate_Hz
    control: Records = np.zeros(1, CONTROL)
    fields: Record = control[0]
    fields["rate_Hz"], fields["divisor"] = rate_Hz, divisor
    fields["output_gain"], fields["asleep"], fields["begun_at_last_scan"] = 1.0, 1, -1
    bank = bank_of(scene, step_s)
    return Engine(
        **_common(scene, step_s, divisor, strikes, of_modes(highest_zero(scene, 1.0 / step_s), scene.drum)),
        control=control,
        head=ABSENT,  # for compiled code: nothing of a mesh
        forces=cast(Records, np.zeros(0, FORCE)),
        pickups=np.zeros(0, np.int64),
        pickup_gains=np.zeros((0, 2), np.float32),
        modal=bank,
        blocks=blocks_for(scene, bank),
        effects=effects_of(Building(scene, step_s, _unit_m(scene))),
        mallets=mallets_on_modes(scene, step_s, len(bank.q)),
    )


def new_engine(scene: Scene, rate_Hz: int, strikes: StrikeRing) -> Engine:
    """An engine at rest, fed from `strikes`, its gain still 1. Raises Unplayable."""
    try:
        engine = (_of_mesh if scene.modal is None else _of_modes)(scene, rate_Hz, strikes)
    except ImportError as error:
        raise Unplayable(
            f"the drum of {scene.name} needs {error.name}: install haptic-drumstick[sound]"
        ) from error
    except (ValueError, ArithmeticError) as error:
        # What each effect may be is checked when the scene is read; that together they leave a wave no room, here.
        named = ", ".join(scene.drum.effects) or "no effects"
        raise Unplayable(
            f"the drum of {scene.name} cannot be computed at {rate_Hz} Hz with {named} ({error}): make the effects"
            " weaker, or the mesh finer"
        ) from error
    return with_fade(engine) if scene.listen.pickup_places == "live" else engine


def copy_of(engine: Engine, strikes: StrikeRing) -> Engine:
    """A copy of an engine that has not sounded, fed from other strikes; a large bank takes seconds to build anew."""
    copied: Engine = _copied(engine, {})
    return copied._replace(ring_cells=strikes.cells, ring_slots=strikes.slots)


def _copied(part: Any, made: dict[int, Any]) -> Any:
    # made: arrays by their addresses, so that one which two parts share is shared again.
    if isinstance(part, np.ndarray):
        given = cast(np.ndarray[Any, np.dtype[Any]], part)
        if id(given) not in made:
            # Vectors of float32 are loaded from boundaries.
            found = aligned(given.shape) if given.dtype == np.float32 else np.empty_like(given)
            found[...] = given
            made[id(given)] = found
        return made[id(given)]
    if hasattr(part, "_make"):  # a named tuple
        return part._make(_copied(each, made) for each in part)
    return (
        tuple(_copied(each, made) for each in cast(tuple[Any, ...], part))
        if isinstance(part, tuple)
        else part
    )


def size_of(engine: Engine) -> int:
    """Junctions of the head, or oscillators of the bank that can move."""
    if is_there(engine.modal):
        return 2 * len(engine.modal.orders)
    return int(np.count_nonzero(engine.head.weights))


def describe_renderer(engine: Engine) -> str:
    """Description of the renderer in a few words, for the log."""
    control: Control = engine.control[0]
    rate = control["rate_Hz"] / control["divisor"]
    if is_there(engine.modal):
        return f"bank of {size_of(engine)} modes at {rate:g} Hz"
    across = 2.0 / engine.head.grid["spacing"][0]
    order = ", fourth order" if is_there(engine.laplacian) else ""
    threads = ", for two threads" if is_there(engine.shared_sweep) else ""
    return f"mesh of {across:.1f} junctions across ({size_of(engine)}) at {rate:g} Hz{order}{threads}"
