"""Options of the sound server's process. Any thread."""

from fnmatch import fnmatchcase
from typing import Annotated

from msgspec import Meta

from protocol.access.identity import Identity
from protocol.keys import DEFAULT_RIG, DEFAULT_ROUTER
from protocol.pattern import checked_pattern, is_pattern
from realtime.service_options import ServiceOptions
from sound_server.outputs import Outputs, check
from sound_server.ranges import (
    BLOCKS,
    DEFAULT_BLOCK,
    DEFAULT_RATE_HZ,
    MAX_DELAY_MS,
    MAX_RIGS,
    RATES_HZ,
    GAINS_dB,
)


class SoundOptions(ServiceOptions, frozen=True, kw_only=True):
    """rigs: whose drums to play; one with * stands for all that come and go. Rate in Hz, block in frames.

    room_latency_ms, room_level_dB: beyond the scenes' own. outputs: channels of the device for rigs and
    for single microphones. awaited: play for nobody until the audio device is there.
    """

    rigs: Annotated[tuple[str, ...], Meta(min_length=1)] = (DEFAULT_RIG,)
    most_rigs: Annotated[int, Meta(ge=1, le=MAX_RIGS)] = MAX_RIGS
    connect: str = DEFAULT_ROUTER
    identity: Identity | None = None
    audio: str = "auto"
    rate: Annotated[int, Meta(ge=RATES_HZ[0], le=RATES_HZ[1])] = DEFAULT_RATE_HZ
    block: Annotated[int, Meta(ge=BLOCKS[0], le=BLOCKS[1])] = DEFAULT_BLOCK
    awaited: bool = False
    room_latency_ms: Annotated[float, Meta(ge=0.0, le=MAX_DELAY_MS)] = 0.0
    room_level_dB: Annotated[float, Meta(ge=GAINS_dB[0], le=GAINS_dB[1])] = 0.0
    outputs: Outputs = ()

    def __post_init__(self) -> None:
        named = {rig for rig in self.rigs if not is_pattern(checked_pattern(rig))}
        if len(named) > self.most_rigs:
            raise ValueError(f"{len(named)} rigs are more than the {self.most_rigs} that this server plays")
        check(self.outputs)
        for pair in self.outputs:
            if not any(fnmatchcase(pair.rig, rig) for rig in self.rigs):
                raise ValueError(f"no rig {pair.rig} is played: this server plays {', '.join(self.rigs)}")
