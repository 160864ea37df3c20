"""Recordings for tests: any message there is, and files made of them by the product's own writer."""

import json
import math
import struct
from collections.abc import Iterable
from pathlib import Path

from hypothesis import strategies as st

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import as_tables
from protocol.messages import Choke, Contact, Message, Meter, Readback, Release, State, Strike
from rig.recording.channels import Channel, Presence, channel_of
from rig.recording.mcap_writer import SCENE_ATTACHMENT, McapWriter
from rig_messages import state

_NS = 1_000_000_000
START_NS = 1_700_000_000 * _NS

_floats = st.floats(allow_nan=False, allow_infinity=False)
_numbers = st.integers(0, 2**63 - 1)
_texts = st.text(max_size=12)
_forces = st.lists(st.floats(width=32, allow_nan=False, allow_infinity=False), max_size=8)
_FIELDS = {
    float: _floats,
    int: _numbers,
    str: _texts,
    bool: st.booleans(),
    bytes: _forces.map(lambda forces: struct.pack(f"<{len(forces)}f", *forces)),
    float | None: st.none() | _floats,
    int | None: st.none() | _numbers,
}


def _any(kind: type[Message]) -> st.SearchStrategy[Message]:
    return st.builds(kind, **{name: _FIELDS[hint] for name, hint in kind.__annotations__.items()})


_TOPICS: dict[str, type[Message]] = {
    "/strike": Strike,
    "/release": Release,
    "/choke": Choke,
    "/contact": Contact,
    "/state": State,
    "/meter": Meter,
    "/param/dv_pls": Readback,
    "/param/chaos.gain": Readback,
    "/alive": Presence,
}


def any_messages() -> st.SearchStrategy[list[tuple[str, Message]]]:
    """Topics and messages, in any order."""
    one = st.sampled_from(sorted(_TOPICS)).flatmap(
        lambda topic: st.tuples(st.just(topic), _any(_TOPICS[topic]))
    )
    return st.lists(one, max_size=12)


def channel(topic: str) -> tuple[Channel, str]:
    found = channel_of(topic)
    assert found is not None
    return found


def made(
    path: Path,
    messages: Iterable[tuple[float, str, Message]],
    scene: Scene | None = None,
    finished: bool = True,
    chunk_s: float = 1.0,
) -> Path:
    """A recording of messages, each with its second and topic; a chunk ends after each `chunk_s` of them."""
    filing = McapWriter(path, {"rig": "main", "boot": "7"}, lambda name: "m/s" if name == "dv_pls" else "")
    told = scene or Scene("test")
    filing.attach_scene(SCENE_ATTACHMENT, json.dumps(as_tables(told)).encode(), START_NS)
    for at_s, topic, message in messages:
        at_ns = START_NS + round(at_s * _NS)
        age_ns = round(math.floor(at_s / chunk_s) * _NS)  # as if so much time had gone by
        filing.chunk_if_due(age_ns)
        filing.put(*channel(topic), message, at_ns + 700_000, at_ns, age_ns)
    if finished:
        filing.finish()
    else:
        filing.chunk_if_due(10**18)
        filing.abandon()
    return path


def a_strike(seq: int, boot: int = 7, peak_N: float = 4.0, **fields: float) -> Strike:
    """A strike of a roll of the default scene."""
    told = {
        "x": 0.4,
        "y": 0.1,
        "z_speed_m_per_s": 0.56,
        "level": 0.28,
        "contact_estimate_s": 0.0055,
        **fields,
    }
    return Strike(boot=boot, seq=seq, t_ns=seq * 43_000_000, peak_estimate_N=peak_N, **told)


def a_choke(seq: int, boot: int = 9, t_ns: int = 0) -> Choke:
    return Choke(boot=boot, seq=seq, t_ns=t_ns, source="test")


def a_release(seq: int, boot: int = 7) -> Release:
    """Its release."""
    return Release(
        boot=boot, seq=seq, t_ns=seq * 43_000_000 + 5_400_000, exit_speed_m_per_s=0.6, impulse_N_s=0.02, peak_N=4.0,
        contact_s=0.0054,
    )  # fmt: skip


def a_state(strikes: int, boot: int = 7, status: str = "playing") -> State:
    """A state of the servo."""
    return state(
        boot=boot, t_ns=1, status=status, z_m=0.001, v_m_per_s=0.1, force_N=0.5, x=0.1, y=0.2, roll_rate_Hz=23.0,
        v_e_m_per_s=0.6, strikes=strikes, ticks=1000, lateness_p99_us=60.0, lateness_worst_us=200.0, revision=3,
    )  # fmt: skip
