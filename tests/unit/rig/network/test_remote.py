"""Commands that ask a running rig: what they say when it is there and does not answer."""

import socket
from queue import SimpleQueue

import pytest
import zenoh

from ports import free_port
from protocol.keys import Keys
from protocol.session import open_router
from rig.exit_status import LACKING, CommandError
from rig.network.remote import _ask, attempt, opened
from rig.network.remote_rig import RemoteRig


def test_who_listens_without_an_answer_is_asked_again_until_a_stop() -> None:
    with socket.create_server(("127.0.0.1", 0)) as mute:
        end = RemoteRig(f"tcp/127.0.0.1:{mute.getsockname()[1]}", Keys("test"))
        goes_on = iter((True, True, False))
        assert attempt(end, lambda: next(goes_on)) == (None, "")
    assert list(goes_on) == []


def test_a_rig_that_takes_too_long_may_have_done_it_all_the_same() -> None:
    end = RemoteRig(f"tcp/127.0.0.1:{free_port()}", Keys("test"))
    asked: SimpleQueue[zenoh.Query] = SimpleQueue()  # a query that is kept is neither answered nor given up
    with open_router(end.endpoint) as rig:
        rig.declare_queryable(end.keys.panic, asked.put)
        with (
            opened(end) as session,
            pytest.raises(CommandError, match=r"within 0\.2 s: it may have been done all the same") as said,
        ):
            _ask(session, end.keys.panic, within_s=0.2)
        assert asked.get(timeout=60).key_expr == zenoh.KeyExpr(end.keys.panic)
    assert said.value.status == LACKING
