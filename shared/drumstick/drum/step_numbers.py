"""Numbers of one step of the head: its scheme, its losses, and what is baked into the weights. Any thread."""

import numpy as np

from drumstick.drum.effects import head_numbers
from drumstick.drum.engine import CONTROL
from drumstick.drum.membrane.scheme import Losses, Scheme, even_losses, rising_losses
from drumstick.drum.membrane.step_coefficients import StepCoefficients
from drumstick.drum.modal.air_on_mesh import taken_room
from drumstick.parameters.drum import Drum
from drumstick.parameters.scene import Scene
from realtime.records import Record, Records


def _losses(drum: Drum, step_s: float) -> Losses:
    t60_s, besides_per_s = drum.t60_s, head_numbers.even_losses_per_s(drum)
    if besides_per_s > 0.0:
        t60_s = 1.0 / (1.0 / t60_s + besides_per_s)
    rising = head_numbers.rising_loss(drum)
    if rising is None:
        return even_losses(t60_s, step_s)
    high_t60_s, high_Hz = rising
    return rising_losses(t60_s, drum.f01_Hz, min(high_t60_s, 0.999 * t60_s), high_Hz, step_s)


def coefficients_at(scene: Scene, step_s: float, whole: Scheme) -> StepCoefficients:
    """Numbers of the first head, with a step every `step_s`, and what its effects leave of the `whole` scheme."""
    drum = scene.drum
    losses, spring = _losses(drum, step_s), head_numbers.spring(drum, step_s)
    # A spring adds at most 2 K T^2 to q, the losses take from what is stable.
    room = (4.0 - 2.0 * spring - taken_room(drum, step_s)) / 4.0 * losses.most
    rise = head_numbers.tension_rise(drum) or 0.0
    return StepCoefficients(losses, spring, whole.squeezed(room, 1.1 * rise))


def control_of(numbers: StepCoefficients, scene: Scene, rate_Hz: int, divisor: int) -> Records:
    """The engine's control record, (1,) of CONTROL."""
    scheme = numbers.scheme
    control: Records = np.zeros(1, CONTROL)
    fields: Record = control[0]
    fields["rate_Hz"], fields["divisor"] = rate_Hz, divisor
    fields["tau"], fields["loss_divisor"] = scheme.tau, numbers.loss_divisor
    fields["own_gain"] = numbers.weight_scale
    for name, gain in numbers.gains().items():
        fields[name] = gain
    if numbers.with_momentum and not scheme.order_4:
        fields["u_gain"] = scheme.tau
    # u'' = c^2 (laplace u + F delta / tension): a step adds (c T/h)^2 F / (a junction's area / h^2) where the
    # weight is 1 / neighbours. The tension is 1; the level is calibrated.
    neighbours, height = scheme.topology.neighbours, scheme.topology.row_height
    fields["force_gain"] = (
        neighbours * scheme.tau / 4.0 / height / (numbers.weight_scale * numbers.loss_divisor)
    )
    fields["spread"] = scene.drum.inject == "linear"
    fields["output_gain"] = 1.0
    fields["asleep"], fields["begun_at_last_scan"] = 1, -1
    return control
