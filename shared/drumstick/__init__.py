"""Sticks and drums of the haptic drumstick, for whoever writes Python: `import drumstick as ds`.

The names in `__all__` are the public face (docs/python.md); each is imported when it is first used. The rooms below
belong to the instrument and may change. Berdahl, Verplank, Smith and Niemeyer, "A physically intuitive haptic
drumstick", ICMC 2007. z points up, the membrane is at z = 0, the stick is in contact at z < 0. SI units. No I/O but
scene files: arrays and numbers come out.

| room | holds |
|---|---|
| `public`, `files` | the public face: runs and sounds to look at; scene files |
| `parameters` | declarations with ranges and units, what a scene is |
| `scenes` | TOML, the shipped scenes, the table of what can be set live |
| `stick` | contact law, effects, exact motion, fixed steps, simulation |
| `drum` | membrane, modes, excitation, drum effects, output; engine, calibration, accuracy, offline rendering |
| `safety` | bounds, the joint envelope, the fence: which sets are accepted, and the reason for a refusal |
| `analysis` | return map, cycles and multipliers, capture, predictions; timing of a player's strikes |
| `testing`, `packages` | conformance of effects and devices of others; where installed packages give them |

>>> import drumstick as ds
>>> run = ds.simulate(ds.scene("roll", dv_pls=0.3), duration_s=2.0)
>>> round(run.rate_Hz, 1)
18.7
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from drumstick.analysis.cycles.cycle import Cycle
    from drumstick.analysis.findings import Findings, analyse
    from drumstick.analysis.timing import Timing, timing
    from drumstick.drum.build import Unplayable
    from drumstick.files import save, scene
    from drumstick.parameters.declare import number
    from drumstick.parameters.scene import Scene
    from drumstick.public.run import Run, simulate
    from drumstick.public.sound import Blow, Sound, render, strike
    from drumstick.safety.envelope import OutOfEnvelope
    from drumstick.scenes.scene_text import SceneError
    from drumstick.scenes.scene_text import shipped_names as scene_names
    from drumstick.scenes.table import scene_values as values
    from drumstick.stick.effects.own_effect import Effect
    from drumstick.stick.simulate import Stepper, TooLong
    from haptic_server.servo.device.own_device import Device
    from haptic_server.servo.offline import ServoRun, servo
    from haptic_server.specification import Specification
    from realtime.records import Record

    __version__: str

__all__ = [
    "Blow",
    "Cycle",
    "Device",
    "Effect",
    "Findings",
    "OutOfEnvelope",
    "Record",
    "Run",
    "Scene",
    "SceneError",
    "ServoRun",
    "Sound",
    "Specification",
    "Stepper",
    "Timing",
    "TooLong",
    "Unplayable",
    "__version__",
    "analyse",
    "number",
    "render",
    "save",
    "scene",
    "scene_names",
    "servo",
    "simulate",
    "strike",
    "timing",
    "values",
]

# Where each name lives, and what it is called there.
_HOMES = {
    "Blow": "drumstick.public.sound:Blow",
    "Cycle": "drumstick.analysis.cycles.cycle:Cycle",
    "Device": "haptic_server.servo.device.own_device:Device",
    "Effect": "drumstick.stick.effects.own_effect:Effect",
    "Findings": "drumstick.analysis.findings:Findings",
    "OutOfEnvelope": "drumstick.safety.envelope:OutOfEnvelope",
    "Record": "realtime.records:Record",
    "Run": "drumstick.public.run:Run",
    "Scene": "drumstick.parameters.scene:Scene",
    "SceneError": "drumstick.scenes.scene_text:SceneError",
    "ServoRun": "haptic_server.servo.offline:ServoRun",
    "Sound": "drumstick.public.sound:Sound",
    "Specification": "haptic_server.specification:Specification",
    "Stepper": "drumstick.stick.simulate:Stepper",
    "Timing": "drumstick.analysis.timing:Timing",
    "TooLong": "drumstick.stick.simulate:TooLong",
    "Unplayable": "drumstick.drum.build:Unplayable",
    "analyse": "drumstick.analysis.findings:analyse",
    "number": "drumstick.parameters.declare:number",
    "render": "drumstick.public.sound:render",
    "save": "drumstick.files:save",
    "scene": "drumstick.files:scene",
    "scene_names": "drumstick.scenes.scene_text:shipped_names",
    "servo": "haptic_server.servo.offline:servo",
    "simulate": "drumstick.public.run:simulate",
    "strike": "drumstick.public.sound:strike",
    "timing": "drumstick.analysis.timing:timing",
    "values": "drumstick.scenes.table:scene_values",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        found: Any = version("haptic-drumstick")
    elif name in _HOMES:
        module, _, own_name = _HOMES[name].partition(":")
        found = getattr(import_module(module), own_name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = found  # asked once
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
