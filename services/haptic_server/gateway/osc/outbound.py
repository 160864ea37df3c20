"""The sending side of an OSC server, as its receiving side uses it."""

from typing import NamedTuple

from haptic_server.gateway.osc.echo_filter import EchoFilter
from haptic_server.gateway.osc.osc_sender import OscSender
from haptic_server.gateway.osc.own_addresses import OwnAddress
from haptic_server.gateway.osc.refusal_counts import RefusalCounts
from haptic_server.gateway.osc.reply_targets import ReplyTargets
from haptic_server.gateway.osc.targets import Targets


class Outbound(NamedTuple):
    """The sending side of an OSC server. `own` is its own socket, which is never heard and never becomes a target."""

    own: OwnAddress
    packets_out: OscSender
    targets: Targets
    reply_targets: ReplyTargets
    echo_filter: EchoFilter
    refusals: RefusalCounts
