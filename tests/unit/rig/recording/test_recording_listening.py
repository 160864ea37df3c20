"""Recorder's listening: nothing is lost when it stops, however slow it is; no answer comes after a newer value."""

import time
from queue import SimpleQueue
from threading import Event
from types import SimpleNamespace

import pytest
import zenoh
from rig_process import free_port, is_subscribed, wait_for

from protocol import messages
from protocol.keys import Keys
from protocol.session import open_router
from realtime.stop import StopRequest
from rig.network.remote_rig import RemoteRig
from rig.recording import channels
from rig.recording.channels import Channel
from rig.recording.recorder_session import Item, Received, RecorderSession
from rig_messages import strike

MANY = 300


def _strike(seq: int) -> bytes:
    return messages.encode(strike(seq=seq))


def test_what_was_heard_is_there_when_it_has_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    endpoint, keys = f"tcp/127.0.0.1:{free_port()}", Keys("test")
    heard: list[int] = []
    with open_router(endpoint) as rig:
        listening = RecorderSession(RemoteRig(endpoint, keys))
        kept = listening._put

        all_arrived = Event()

        def behind(channel: Channel, item: Item) -> None:
            assert all_arrived.wait(60.0)
            time.sleep(0.002)
            kept(channel, item)

        monkeypatch.setattr(listening, "_put", behind)
        assert listening.open(StopRequest(), wait=True)
        listening.listen(force=False)
        publisher = rig.declare_publisher(keys.strike)
        wait_for("the subscription", lambda: is_subscribed(publisher))
        arrived: list[zenoh.Sample] = []
        own = listening.session.declare_subscriber(
            keys.strike, zenoh.handlers.Callback(arrived.append, indirect=False)
        )
        for seq in range(MANY):
            publisher.put(_strike(seq))
        wait_for("all of them", lambda: len(arrived) == MANY)
        own.undeclare()
        assert listening.items.empty()  # it is behind
        all_arrived.set()
        listening.close()
        while not listening.items.empty():
            item = listening.items.get()
            if isinstance(item, Received) and item.channel is channels.STRIKE:
                heard.append(messages.decode(item.payload, messages.Strike).seq)
    assert sorted(heard) == list(range(MANY))


class _Published:
    """A subscriber, and the samples that reach it."""

    def __init__(self) -> None:
        self.samples: SimpleQueue[SimpleNamespace | None] = SimpleQueue()

    def recv(self) -> SimpleNamespace:
        sample = self.samples.get()
        if sample is None:
            raise zenoh.ZError("closed")
        return sample


def _readback(name: str, value: float, revision: int) -> SimpleNamespace:
    payload = messages.encode(messages.Readback(value=value, revision=revision))
    return SimpleNamespace(key_expr=Keys("test").param(name), payload=zenoh.ZBytes(payload))


def test_an_answer_that_was_overtaken_is_not_recorded_after_the_newer_value(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    listening, published = RecorderSession(RemoteRig("", Keys("test"))), _Published()
    listening._read_by_thread(published, channels.PARAM)

    def asked(_key: str) -> list[SimpleNamespace]:
        answers = [_readback("dv_pls", 0.2, 1), _readback("k_coll", 5000.0, 1)]
        published.samples.put(_readback("dv_pls", 0.3, 2))
        wait_for("the newer one", lambda: not listening.items.empty())
        return answers

    monkeypatch.setattr(listening, "_asked", asked)
    listening.ask_params()
    published.samples.put(None)
    heard = [listening.items.get_nowait() for _ in range(listening.items.qsize())]
    values = [
        (h.name, messages.decode(h.payload, messages.Readback).value)
        for h in heard
        if isinstance(h, Received)
    ]
    assert values == [("dv_pls", 0.3), ("k_coll", 5000.0)]
