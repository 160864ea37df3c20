"""The speed of the roll, v_lc, predicted two ways: equation (7) as printed, and with the gain kappa of the real pulse.

    v_lc = beta dv/(1 - alpha beta)                                        (7)
    v_lc = kappa dv/(1 - alpha beta),   from v_E = beta |v_in| + kappa dv

Equation (7) is the second one for a quick pulse *into* the drum at entry: kappa = beta. A quick pulse up at entry,
which is what the text says, has kappa near -1: there the line v_E = beta |v_in| + kappa dv meets no roll at all. What
happens instead is that the pulse throws the stick back before it compresses the head, v_E = dv - |v_in|, and that
settles at dv/(1 + alpha).
"""

from drumstick.analysis.gain import gain, kappa, overdamped
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.stick.contact import beta_eq3
from drumstick.stick.effects.cor_pulse import CorPulse
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.effects.registry import names_with

# Effects of the head that change R_in or K_coll within a contact: kappa has no closed form then.
ALTERED_HEADS = names_with("ALTERS_HEAD")


def restitution_eq3(stick: Stick) -> float | None:
    """beta by equation (3); None when overdamped."""
    if overdamped(stick):
        return None
    return float(beta_eq3(stick.m_kg, stick.k_coll_N_per_m, stick.r_in_N_s_per_m))


def pulse_of(scene: Scene) -> Pulse | None:
    """The scene's pulse, equation (4), if it has one."""
    return scene.effects.get("pulse")


def kappa_of(scene: Scene) -> float | None:
    """kappa of the scene's pulse; None without one, and where it has no closed form."""
    pulse = pulse_of(scene)
    if pulse is None or any(name in scene.effects for name in ALTERED_HEADS):
        return None
    return kappa(scene.stick, pulse)


def _limit(added_m_per_s: float, factor: float) -> float | None:
    # The fixed point of v -> factor v + added.
    return added_m_per_s / (1.0 - factor) if added_m_per_s > 0.0 and factor < 1.0 else None


def added_restitution(scene: Scene) -> float:
    """Restitution that `cor_pulse` adds, to first order and without the hand: its speed times its own gain, or 0.

    gamma in the limit tau -> 0 of the paper's own: at entry, into the drum, scale "speed_over_beta".
    """
    also: CorPulse | None = scene.effects.get("cor_pulse")
    if also is None:
        return 0.0
    beta = restitution_eq3(scene.stick) if also.scale == "speed_over_beta" else 1.0
    gained = gain(scene.stick, also.trigger, also.sign, also.tau_s)
    return also.gamma / beta * gained if beta and gained else 0.0


def v_lc_eq7(scene: Scene, alpha: float) -> float | None:
    """v_lc by equation (7), m/s, with beta by (3); None without a pulse, overdamped, or when alpha beta >= 1."""
    pulse, beta = pulse_of(scene), restitution_eq3(scene.stick)
    if pulse is None or beta is None:
        return None
    return _limit(beta * pulse.dv_m_per_s, alpha * beta)


def v_lc_kappa(scene: Scene, alpha: float, beta: float | None) -> float | None:
    """v_lc with the pulse's own gain, m/s; beta: measured at the roll's |v_in|. None where it predicts no roll.

    With `cor_pulse` beta is raised by what that one adds, gamma times its own gain.
    """
    pulse, gained = pulse_of(scene), kappa_of(scene)
    if pulse is None or gained is None:
        return None
    if gained <= 0.0:
        thrown_back = pulse.trigger == "entry" and pulse.sign > 0
        return _limit(pulse.dv_m_per_s, -alpha) if thrown_back else None
    if beta is None:
        return None
    return _limit(gained * pulse.dv_m_per_s, alpha * (beta + added_restitution(scene)))
