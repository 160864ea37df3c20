"""Zenoh payloads: msgpack arrays whose first element is the version.

SI units; times are the haptic machine's monotonic ns. Any thread; encoding allocates.
"""

import math
from typing import TypeVar, cast

import msgspec

VERSION = 1
ENCODING = "application/msgpack"
# How much of a contact goes into one Contact message: a listener waits at least for that.
CONTACT_PIECE_S = 0.002
NO_REVISION = -1  # of a sound server that has heard of none
STICK = "stick"  # source of what the rig's own stick does


class Message(msgspec.Struct, array_like=True, frozen=True, kw_only=True):
    """Base of every payload: an array that begins with the version."""

    version: int = VERSION


class Strike(Message, array_like=True, frozen=True, kw_only=True):
    """The stick met the head. x, y in -1..1 of the radius; z_speed > 0 downward; level 0..1 of full scale.

    Peak, time and impulse are of the contact that begins, foreseen to its end: its release tells what they were.
    `source`: what made the strike; "stick" for the rig's own. A played strike has a `boot` of its own, and `seq` counts
    the strikes of that boot.
    """

    boot: int
    seq: int
    t_ns: int
    x: float
    y: float
    z_speed_m_per_s: float
    level: float
    peak_estimate_N: float
    contact_estimate_s: float
    impulse_N_s: float = 0.0
    source: str = STICK


class Release(Message, array_like=True, frozen=True, kw_only=True):
    """The stick left the head again; `boot`, `seq` and `source` are those of its strike. A contact that is cut off,
    since its servo ends or gives way to another scene's, has none, for no stick left: it is over when `boot` changes.
    """

    boot: int
    seq: int
    t_ns: int
    exit_speed_m_per_s: float
    impulse_N_s: float
    peak_N: float
    contact_s: float
    source: str = STICK


class Choke(Message, array_like=True, frozen=True, kw_only=True):
    """A player stops the drum: what was struck before it ends. `seq` counts the chokes of that boot; `source`: who."""

    boot: int
    seq: int
    t_ns: int
    source: str


class Contact(Message, array_like=True, frozen=True, kw_only=True):
    """A piece of one contact's force: `forces` are float32, little-endian, N, each the mean over one servo tick, the
    first over tick first_tick, which began at t_ns; ticks come at rate_Hz. `seq` is that of the strike; 0 N closes a
    contact. t_ns, x, y may be left out: then time goes by arrival, and x, y are the strike's.
    """

    boot: int
    seq: int
    first_tick: int
    rate_Hz: float
    forces: bytes
    t_ns: int | None = None
    x: float | None = None
    y: float | None = None


class State(Message, array_like=True, frozen=True, kw_only=True):
    """The servo, 30 times a second. `status` is ready, playing, panic or "fault: why".

    `next_scene`: the one that is made ready meanwhile, "" none; `scene_refusal`: why the last one was not played.
    """

    boot: int
    t_ns: int
    status: str
    z_m: float
    v_m_per_s: float
    force_N: float
    x: float
    y: float
    roll_rate_Hz: float
    v_e_m_per_s: float
    strikes: int
    ticks: int
    overruns: int
    lateness_p99_us: float
    lateness_worst_us: float
    ring_dropped: int
    revision: int
    pending: bool
    next_scene: str = ""
    scene_refusal: str = ""


class Readback(Message, array_like=True, frozen=True, kw_only=True):
    """One parameter as the servo uses it; `revision` grows with every accepted change."""

    value: float
    revision: int
    pending: bool = False


class SetReply(Message, array_like=True, frozen=True, kw_only=True):
    """Answer to a set of several values: the readback, or what will hold once the stick is above the head."""

    values: dict[str, float]
    revision: int
    pending: bool


class PresetReply(Message, array_like=True, frozen=True, kw_only=True):
    """Answer to `preset/load`: as SetReply. `note` is not empty when an older version of a damaged file was used."""

    name: str
    values: dict[str, float]
    revision: int
    pending: bool
    note: str = ""


class PresetNews(Message, array_like=True, frozen=True, kw_only=True):
    """A preset was "saved", "loaded", "renamed" or "deleted". `before`: the name that a renamed one had."""

    what: str
    name: str
    before: str = ""


class LeaseRequest(Message, array_like=True, frozen=True, kw_only=True):
    """Take or renew the writer's lease for `seconds`, at most 5; 0 gives it back. `who` is the holder's own secret, and
    its sets carry it as claim; `name` is shown to others.
    """

    who: str
    name: str
    seconds: float = 5.0


class Lease(Message, array_like=True, frozen=True, kw_only=True):
    """Holder of the exclusive right to set, and for how long still; "" and 0 when everybody may."""

    name: str
    left_s: float


class RefusalReply(Message, array_like=True, frozen=True, kw_only=True):
    """Payload of a Zenoh error reply."""

    reason: str


class Pointer(Message, array_like=True, frozen=True, kw_only=True):
    """Wanted place of the simulated stick: lift 0 presses at z_ss, 1 is lifted; x, y in -1..1 of the radius.

    `source` names one page or program, whose `seq` grows; `held` is false when it lets go. What is not heard again for
    0.4 s lets go too. Numbers outside are cut.
    """

    source: str
    seq: int
    held: bool
    lift: float
    x: float
    y: float


class Clock(Message, array_like=True, frozen=True, kw_only=True):
    """Answer of `clock`."""

    boot: int
    t_ns: int


class Meter(Message, array_like=True, frozen=True, kw_only=True):
    """The sound server, 10 times a second. Peaks and rms: linear, 1 is full scale; left and right: of this rig's drum;
    output: of all that leaves, every rig's drum, behind the limiter. load: share of a block's time.
    """

    id: str
    t_ns: int
    sink: str
    peak_left: float
    peak_right: float
    load: float
    xruns: int
    latency_ms: float
    played: int
    late: int
    duplicates: int
    underflows: int = 0  # of a streamed force: gaps that had to be bridged
    refused: int = 0  # messages that held nonsense
    arrival_ms: float = 0.0  # from a contact to its strike's arrival, median of the newest
    jitter_ms: float = 0.0  # between the slowest and the quickest twentieth of them
    unpunctual: int = 0  # came after the instant at which they should have sounded
    revision: int = NO_REVISION  # of the set whose values of the drum sound
    waiting: str = ""  # what of the newest set does not sound yet, or cannot, in words
    output_peak: float = (
        0.0  # of the loudest channel, falls back by itself; 0 too from a server that has no such meter
    )
    output_rms: float = 0.0  # of the loudest channel, by a VU meter's 0.3 s: 0.707 for a sine of full scale
    limited_frames: int = 0  # that the limiter bent, since the sink was opened
    clipped_frames: int = 0  # those of them that left at full scale


class Membrane(Message, array_like=True, frozen=True, kw_only=True):
    """The head's surface. `heights`: int16, little-endian, times unit_m is m, up is positive: the centre, then ring by
    ring from inside, each from +x anticlockwise. Ring i of `rings` lies at i / (rings + 1) of the radius; the rim
    rests. t_ns: when it was taken.
    """

    id: str
    t_ns: int
    rings: int
    spokes: int
    unit_m: float
    heights: bytes


class Spectrum(Message, array_like=True, frozen=True, kw_only=True):
    """Spectrum of the drum's last sound. `levels`: float32, little-endian, dB of full scale, from 0 Hz to top_Hz in
    equal steps, each the loudest of its step; over the last window_s.
    """

    id: str
    t_ns: int
    top_Hz: float
    window_s: float
    levels: bytes


class Cost(Message, array_like=True, frozen=True, kw_only=True):
    """Cost of a way to render the drum: `accuracy` is "now", or one that a scene may ask for. `words` say
    what renders it now. share: of the computing that it takes now; cents: the rms error of the first twenty modes,
    the lowest being in tune. A bank of modes tells only "now".
    """

    id: str
    words: str
    accuracy: str
    mesh_rate_Hz: float
    across: float
    share: float
    cents: float


def number_of(message: Strike | Release) -> int:
    """Number of a strike where no `boot` is told, as in OSC: that of a played one is negative."""
    return message.seq if message.source == STICK else -message.seq


_encoder = msgspec.msgpack.Encoder()
_M = TypeVar("_M", bound=Message)


def encode(message: Message) -> bytes:
    """The message as msgpack bytes."""
    return _encoder.encode(message)


def decode(payload: bytes, kind: type[_M]) -> _M:
    """Decode and check; ValueError for anything that is not a version-1 message with finite numbers."""
    try:
        message = msgspec.msgpack.decode(payload, type=kind)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"not a {kind.__name__}: {error}") from None
    if message.version != VERSION:
        raise ValueError(f"{kind.__name__} of version {message.version}, this is version {VERSION}")
    for name in kind.__struct_fields__:
        value = getattr(message, name)
        for number in cast("dict[str, float]", value).values() if isinstance(value, dict) else (value,):
            if isinstance(number, float) and not math.isfinite(number):
                raise ValueError(f"{kind.__name__}.{name} is {value}")
    return message
