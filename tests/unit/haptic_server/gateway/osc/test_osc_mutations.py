"""Mutated messages by the thousand: none stops the front, and every good message between them is served."""

import math
import random
import socket

from haptic_server.gateway.osc.osc_server import OscServer
from osc_bench import FakeParameters, Time, built, client, opened_front, tell
from osc_mutants import KILLERS, MUTANT_HOST, mutant
from stability.catalogue import shows

P = "/drumstick"


def _assert_serves(front: OscServer, parameters: FakeParameters, time: Time) -> None:
    with client() as good:
        assert tell(front, good, built(P + "/ping", 7)) == [("/drumstick/pong", [7])]
        assert len(tell(front, good, built(P + "/param/m"))) == 2
        time.s += 1.0
        parameters.now_s += 10.0  # a mutant may have taken the lease
        sets, panics = len(parameters.sets), len(parameters.panics)
        front.receive(built(P + "/param/r_in", 1.0 + 1e-3 * sets), good.endpoint)  # another value each time
        front.receive(built(P + "/panic"), good.endpoint)
        assert (len(parameters.sets), len(parameters.panics)) == (sets + 1, panics + 1)


@shows("message that never ends", "ours")
def test_twenty_thousand_mutants() -> None:
    chance, parameters, time = random.Random(20070827), FakeParameters(), Time()
    with opened_front(parameters, now=time) as front:
        good = 0
        for i in range(20_000):
            time.s += 0.001
            packet = KILLERS[i // 1000 % len(KILLERS)] if i % 1000 == 0 else mutant(chance)
            front.receive(packet, (MUTANT_HOST, 40000 + i % 50))
            if i % 500 == 0:
                _assert_serves(front, parameters, time)
                good += 4
        heard = front.counters
        heard = {k: n for k, n in heard.items() if not k.startswith("send")}
        assert sum(heard.values()) == 20_000 + good  # each is served, or refused for one reason
        assert "fault" not in heard
        # The mutations are worth something: all kinds of refusal occur, and much is still served.
        assert {"unreadable", "address", "arguments", "value", "served"} <= set(heard)
        assert heard["served"] > 300 + good
        assert all(
            math.isfinite(v) and parameters.table[n].quantity.low <= v <= parameters.table[n].quantity.high
            for values, _ in parameters.sets
            for n, v in values.items()
        )


def test_mutants_through_the_socket() -> None:
    chance, parameters = random.Random(4), FakeParameters()
    mutants = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    mutants.bind((MUTANT_HOST, 0))
    with mutants, client() as good, opened_front(parameters) as front:
        for i in range(300):
            mutants.sendto(mutant(chance), front.endpoint)
            if i % 10 == 0:
                good.udp.sendto(built(P + "/ping", i), front.endpoint)
                assert good.next() == ("/drumstick/pong", [i])
        assert "fault" not in front.counters
