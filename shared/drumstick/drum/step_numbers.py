"""Numbers of one step of the head: its scheme, its losses, and what is baked into the weights. Any thread."""

import numpy as np

from drumstick.drum.air_constants import AIR_KG_PER_M3, SOUND_M_PER_S
from drumstick.drum.effects.tension import room_of
from drumstick.drum.engine import CONTROL
from drumstick.drum.membrane.scheme import Losses, even_losses, rising_losses
from drumstick.drum.tiers import scheme_for
from drumstick.parameters.drum import Drum
from drumstick.parameters.drum_effects import Cavity as CavityTable
from drumstick.parameters.scene import Scene
from realtime.records import Record, Records


def _losses(drum: Drum, step_s: float) -> Losses:
    t60_s = drum.t60_s
    if "uniform_loss" in drum.effects:
        t60_s = 1.0 / (1.0 / t60_s + 1.0 / drum.effects["uniform_loss"].t60_s)
    if "internal_loss" not in drum.effects:
        return even_losses(t60_s, step_s)
    high = drum.effects["internal_loss"]
    return rising_losses(t60_s, drum.f01_Hz, min(high.t60_s, 0.999 * t60_s), high.at_Hz, step_s)


def _air_spring(table: CavityTable, step_s: float) -> float:
    # K T^2: see effects.cavity.
    stiffness = AIR_KG_PER_M3 * SOUND_M_PER_S**2
    return stiffness / (table.head_kg_per_m2 * table.depth_m) * step_s**2


class StepCoefficients:
    """Numbers of the first head, with a step every `step_s`."""

    def __init__(self, scene: Scene, step_s: float) -> None:
        drum = scene.drum
        self.losses = _losses(drum, step_s)
        self.spring = _air_spring(drum.effects["cavity"], step_s) if "cavity" in drum.effects else 0.0
        # The air spring adds at most 2 K T^2 to q, the losses take from what is stable.
        room = (4.0 - 2.0 * self.spring) / 4.0 * self.losses.most
        self.glide = 0.0
        if "tension" in drum.effects:
            self.glide = room_of(drum.effects["tension"])
        self.scheme = scheme_for(scene).squeezed(room / (1.0 + 1.1 * self.glide))
        self.with_momentum = self.losses.eta > 0.0
        self.held_back = 1.0 if self.with_momentum else 1.0 + self.losses.s
        self.baked = 1.0 if self.scheme.order_4 else self.scheme.tau / self.held_back

    def control(self, scene: Scene, rate_Hz: int, divisor: int) -> Records:
        """The engine's control record, (1,) of CONTROL."""
        scheme, s = self.scheme, self.losses.s
        control: Records = np.zeros(1, CONTROL)
        fields: Record = control[0]
        fields["rate_Hz"], fields["divisor"] = rate_Hz, divisor
        fields["tau"], fields["held_back"] = scheme.tau, self.held_back
        fields["own_gain"] = self.baked
        fields["now_gain"] = (2.0 - scheme.tau) / self.held_back
        fields["then_gain"] = (1.0 - s) / self.held_back
        if scheme.order_4:
            fields["now_gain"] = 2.0 / self.held_back
            fields["order_4"] = scheme.order_4 / self.held_back
            fields["order_2"] = (scheme.tau - scheme.order_4) / self.held_back
        elif self.with_momentum:
            fields["now_gain"] = scheme.tau
        # u'' = c^2 (laplace u + F delta / tension): a step adds (c T/h)^2 F / (a junction's area / h^2) where the
        # weight is 1 / neighbours. The tension is 1; the level is calibrated.
        neighbours, height = scheme.topology.neighbours, scheme.topology.row_height
        fields["force_gain"] = neighbours * scheme.tau / 4.0 / height / (self.baked * self.held_back)
        fields["spread"] = scene.drum.inject == "linear"
        fields["output_gain"] = 1.0
        fields["asleep"], fields["looked"] = 1, -1
        return control
