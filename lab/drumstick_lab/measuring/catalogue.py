"""The stored results: which sources each measures, about how long it takes, and what is left to be started by hand."""

from typing import NamedTuple

from drumstick_lab.programs import file_of

_PARAMETERS = ("shared/drumstick/parameters", "shared/drumstick/scenes")
_STICK = (*_PARAMETERS, "shared/drumstick/stick", "shared/realtime/kernels")
_DRUM = (*_PARAMETERS, "shared/drumstick/drum", "shared/realtime/kernels")
_SERVO = (*_STICK, "shared/drumstick/safety", "services/haptic_server/servo")
_SOUND = (*_DRUM, "services/sound_server")
_WIRE = ("shared/protocol", "services/haptic_server/gateway")
_RIG = (*_SERVO, *_WIRE, "shared/drumstick/drum", "services/sound_server", "services/rig/supervision")
_PANEL = (*_RIG, "services/web_panel")


class Entry(NamedTuple):
    """One result. `about_s`: estimate, until a stored result says how long it took.

    `arguments`: of its program in a run of all. `by_hand`: why it is not part of such a run.
    """

    measures: tuple[str, ...]
    about_s: float
    arguments: tuple[str, ...] = ()
    by_hand: str = ""
    command: tuple[str, ...] = ()

    def started_by(self, name: str) -> tuple[str, ...]:
        """Words behind `drumstick`."""
        return self.command or ("lab", name.replace("_", "-"))


CATALOGUE = {
    "accuracy": Entry((*_SERVO, "shared/drumstick/drum"), 480),
    "accessibility": Entry(("services/web_panel",), 25),
    "announced": Entry(_SERVO, 20),
    "as_called_for": Entry(
        _PANEL, 700, by_hand="it compiles every scene twice, ten minutes, and its result is the same on every machine"
    ),
    "audio_live": Entry(_SOUND, 60),
    "beside_recordings": Entry(
        (*_DRUM, "lab/drumstick_lab/measuring/made_beside.py"), 120,
        by_hand="needs the folder of recorded kits: drumstick lab beside-recordings KITS"
    ),
    "composed": Entry(_DRUM, 5),
    "core_share": Entry(_DRUM, 110),
    "door": Entry((*_WIRE, "services/haptic_server/access", "services/rig/identity"), 20),
    "evenness": Entry(
        (), 15, by_hand="needs the Groove MIDI Dataset and mido: drumstick lab evenness FOLDER"
    ),
    "first_start": Entry(_RIG, 40),
    "fuzz": Entry(
        (*_PANEL, "services/rig"), 900, by_hand="its corpus grows the longer it runs: drumstick lab fuzz --seconds N"
    ),
    "gateway_share": Entry((*_SERVO, *_WIRE), 190),
    # A million sets take an hour. Five minutes are some eighty thousand; more of them, by hand, add to those.
    "held_arm": Entry(_SERVO, 330, ("--minutes", "5")),
    "lateness": Entry(_SERVO, 240),
    "listeners": Entry(("shared/protocol", "services/rig/network"), 300),
    "mallet": Entry(_DRUM, 45),
    "mesh_kernel": Entry(_DRUM, 40),
    "mesh_peers": Entry(_DRUM, 75),
    "modal_bank": Entry(_DRUM, 45),
    "month": Entry(_SERVO, 8300, by_hand="a month of ticks takes hours of all processors"),
    "mutation": Entry(
        ("shared/drumstick", "services/haptic_server"), 4400, by_hand="compiles each mutant's kernels: more than an hour"
    ),
    "mutation_tests": Entry(
        ("shared/drumstick", "services/haptic_server"), 4400, by_hand="drumstick lab mutation --matrix: hours",
        command=("lab", "mutation", "--matrix"),
    ),
    "osc_fuzz": Entry((*_SERVO, *_WIRE), 100),
    "panic_amid_change": Entry((*_RIG, "services/haptic_server/presets"), 90),
    "panic_place": Entry(
        _PANEL, 950, by_hand="it brings the page into sixty states at nine sizes, and its result is the same on every machine"
    ),
    "panel_attack": Entry(_PANEL, 340),
    "panel_cost": Entry(_PANEL, 220),
    "panel_latency": Entry(_PANEL, 200),
    "panel_stage": Entry(_PANEL, 290),
    "python_face": Entry((*_STICK, "shared/drumstick/public"), 15),
    "rate_and_level": Entry((*_STICK, "shared/drumstick/safety", "shared/drumstick/analysis"), 5),
    "recording_size": Entry((*_RIG, "services/rig/recording"), 55),
    "refinement": Entry(_DRUM, 15),
    "region": Entry(_SERVO, 90),
    "rendered_restitution": Entry(_SERVO, 5),
    "scene_change": Entry((*_RIG, "services/haptic_server/presets"), 90),
    "soak": Entry(
        _PANEL, 1800, by_hand="half an hour of the real clock; soak.json goes into lab/results",
        command=("soak", "--real-time", "--out", "DIR"),
    ),
    "sound_cost": Entry(_DRUM, 10),
    "start_and_restart": Entry(_PANEL, 150),
    "stopwatch": Entry(_PANEL, 140),
    "step_cost": Entry(_STICK, 10),
    "stick_methods": Entry(_STICK, 30),
    "streamed_force": Entry((*_SERVO, *_WIRE, *_SOUND), 10),
    "streamed_wire": Entry(_RIG, 130, ("--speed", "4")),
    "strike_latency": Entry((*_RIG, *_SOUND), 175),
    "suite": Entry((), 480, by_hand="each run of `make test` adds a row; it is a history, not one figure"),
    "tick_cost": Entry(_SERVO, 65),
    "torture": Entry(_PANEL, 1800, by_hand="hours count, and add up: drumstick lab torture --minutes N"),
    "velocity_estimate": Entry(_SERVO, 5),
    "wire": Entry((*_SERVO, *_WIRE), 260),
}  # fmt: skip


def sources_of(name: str) -> tuple[str, ...]:
    """Files and folders that a result measures, its own program among them; none where each run is of its own version."""
    entry = CATALOGUE[name]
    program = entry.started_by(name)[1] if entry.started_by(name)[0] == "lab" else ""
    return (*dict.fromkeys(entry.measures), *((file_of(program),) if entry.measures and program else ()))
