import queue
import threading

import pytest
from rig_process import wait_for

from protocol.messages import Readback
from web_panel.rig.answer import Answer
from web_panel.rig.set_request import SetRequest
from web_panel.tuning.set_queue import SetQueue


class Asked:
    """A haptic server that answers when told to."""

    def __init__(self) -> None:
        self.seen: queue.SimpleQueue[dict[str, float]] = queue.SimpleQueue()
        self.go = threading.Semaphore(0)

    def __call__(self, request: SetRequest) -> Answer:
        self.seen.put(request.values)
        assert self.go.acquire(timeout=60)
        return Answer({name: Readback(value=value, revision=1) for name, value in request.values.items()})


@pytest.fixture
def asked() -> Asked:
    return Asked()


def one(name: str, value: float) -> SetRequest:
    return SetRequest({name: value})


def test_the_newest_value_wins_and_parameters_do_not_starve_each_other(asked: Asked) -> None:
    requests = SetQueue(asked)
    requests.start()
    requests.want(one("dv_pls", 0.1))
    assert asked.seen.get(timeout=60) == {"dv_pls": 0.1}
    for value in (0.2, 0.3):
        requests.want(one("dv_pls", value))
    requests.want(one("k_coll", 1.0))
    requests.want(one("dv_pls", 0.4))
    asked.go.release(3)
    assert asked.seen.get(timeout=60) == {"dv_pls": 0.4}
    assert asked.seen.get(timeout=60) == {"k_coll": 1.0}
    answers = [requests.answers.get(timeout=60)[0].values for _ in range(3)]
    assert answers == [{"dv_pls": 0.1}, {"dv_pls": 0.4}, {"k_coll": 1.0}]
    requests.close()
    assert asked.seen.empty()


def test_what_stood_before_is_answered_though_more_was_asked_since(asked: Asked) -> None:
    requests = SetQueue(asked)
    requests.start()
    assert requests.newest == 0
    assert requests.has_answered(0)
    requests.want(one("dv_pls", 0.1))
    asked.seen.get(timeout=60)  # under way
    requests.want(one("k_coll", 1.0))
    before = requests.newest
    requests.want(one("tau", 1.0))
    requests.want(one("k_coll", 2.0))  # in the place of one from before
    answered = [requests.has_answered(before)]
    for _ in range(2):
        asked.go.release()
        asked.seen.get(timeout=60)
        answered.append(requests.has_answered(before))
    assert answered == [False, False, True]
    assert not requests.has_answered(requests.newest)
    asked.go.release()
    requests.close()


def test_a_whole_set_comes_after_what_was_wished_before_it(asked: Asked) -> None:
    requests = SetQueue(asked)
    requests.start()
    requests.want(one("tau", 0.1))
    assert asked.seen.get(timeout=60) == {"tau": 0.1}
    requests.want(SetRequest({"dv_pls": 0.1, "k_coll": 1.0}, purpose="A"))
    requests.want(one("dv_pls", 0.3))
    requests.want(SetRequest({"dv_pls": 0.2, "k_coll": 2.0}, purpose="B"))
    asked.go.release(3)
    assert asked.seen.get(timeout=60) == {"dv_pls": 0.3}
    assert asked.seen.get(timeout=60) == {"dv_pls": 0.2, "k_coll": 2.0}
    requests.close()
    assert asked.seen.empty()


def test_who_does_not_hold_the_lease_takes_no_place_of_who_does(asked: Asked) -> None:
    requests = SetQueue(asked)
    requests.start()
    requests.want(one("tau", 0.1))
    assert asked.seen.get(timeout=60) == {"tau": 0.1}
    requests.want(SetRequest({"dv_pls": 0.2}, lease="secret"))
    requests.want(SetRequest({"dv_pls": 0.9}))
    requests.want(SetRequest({"k_coll": 1.0}, lease="secret", purpose="A"))
    requests.want(SetRequest({"k_coll": 2.0}, purpose="B"))
    asked.go.release(5)
    seen = [asked.seen.get(timeout=60) for _ in range(4)]
    assert seen == [{"dv_pls": 0.2}, {"dv_pls": 0.9}, {"k_coll": 1.0}, {"k_coll": 2.0}]
    requests.close()


def test_it_ends_while_something_waits(asked: Asked) -> None:
    requests = SetQueue(asked)
    requests.start()
    requests.want(one("dv_pls", 0.1))
    asked.seen.get(timeout=60)
    requests.want(one("dv_pls", 0.2))
    closing = threading.Thread(target=requests.close)
    closing.start()
    wait_for("the end to begin", lambda: requests._ended)
    asked.go.release()
    closing.join(60)
    assert not closing.is_alive()
    assert asked.seen.empty()


def test_a_wish_refused_here_is_not_sent(asked: Asked) -> None:
    requests = SetQueue(asked)
    requests.refuse(one("dv_pls", 99.0), "too much")
    assert requests.answers.get(timeout=60) == (one("dv_pls", 99.0), Answer(reason="too much", refused=True))
