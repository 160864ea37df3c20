"""Whatever stands in a file from outside, its reader gives what it promises or raises its own error, in few words.

The texts are of the kinds that readers stumble over: numbers of thousands of digits, brackets without end, NaN and
Infinity, halves of characters, names twice, other types, in every place where a file has a value.
"""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drumstick.parameters.declare import quantities
from drumstick.parameters.drum import Drum
from drumstick.parameters.rig import Device, Hand, Servo
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.scenes.recording import TrajectoryError, recording_of
from drumstick.scenes.scene_text import SceneError, as_tables, parse
from drumstick.stick.effects.pulse import Pulse
from haptic_server import files
from haptic_server.presets.preset import PresetError, from_bytes
from recordings import a_release, a_state, a_strike
from rig import last_fault
from rig.exit_status import CommandError
from rig.identity.rig_file import RigFileError
from rig.identity.rig_file import parse as parse_rig_file
from rig.offline import render
from rig.recording.channels import CHANNELS, Channel, as_json, from_json
from rig.recording.recorder import scene_of
from web_panel import accuracy_results

_NUMBERS = [
    "0",
    "-1",
    "1.5",
    "1e999",
    "-1e999",
    "1e-999",
    "9" * 400,
    "9" * 4000,
    "9" * 5000,
    "-" + "9" * 4200,
]
_BOTH = st.sampled_from(
    [*_NUMBERS, "true", '""', '"roll"', '"\\u0000"', '"' + "a" * 5000 + '"', "[]", "[[1, 2], 3]", "[" * 5000,
     "[" * 300 + "]" * 300]
)  # fmt: skip
_JSON = _BOTH | st.sampled_from(
    [
        "NaN",
        "Infinity",
        "-Infinity",
        "null",
        "{}",
        '{"a":1,"a":2}',
        '"\\ud800"',
        '{"\\udfff":0}',
        '{"a":' * 5000,
    ]
)
_TOML = _BOTH | st.sampled_from(
    ["nan", "inf", "-inf", "0x" + "f" * 5000, "{}", "{a={a=1}}", "{a=" * 80 + "1" + "}" * 80, "1979-05-27", "[{}]",
     '"\\ud800"', "{" + ".".join("a" * 150) + "=1}", ".".join("a" * 100_000), "'''\n'''"]
)  # fmt: skip
_CELLS = st.sampled_from(
    [*_NUMBERS, "", "nan", "inf", "x", '"', "\0", "1_0", "\u0661", "a" * 140_000, "\r", ",", "\ufeff"]
)
_EXAMPLES = settings(max_examples=150, deadline=None)


def _in_few_words(error: type[Exception], read: Callable[[], object]) -> None:
    try:
        read()
    except error as refused:
        words = str(refused)
        assert words
        assert all(len(line) < 2000 for line in words.split("\n"))
        words.encode()  # it goes to terminals and over wires


def _object(entries: dict[str, str]) -> str:
    return "{" + ",".join(f"{json.dumps(name)}:{text}" for name, text in entries.items()) + "}"


def _some(good: dict[str, str], texts: st.SearchStrategy[str]) -> st.SearchStrategy[dict[str, str]]:
    # What is good but for one or two values.
    return st.dictionaries(st.sampled_from(sorted(good)), texts, max_size=2).map(lambda bad: good | bad)


_PRESET = {"name": '"a"', "scene": '"b"', "saved_at": '"c"', "values": '{"m":1}', "before": "{}"}
_presets = _some(_PRESET, _JSON | _JSON.map(lambda text: '{"m":' + text + "}")).map(_object)


@_EXAMPLES
@given(_presets | _JSON)
def test_a_preset(text: str) -> None:
    body = text.encode()
    head = f"drumstick-preset 1 sha256={hashlib.sha256(body).hexdigest()}\n".encode()
    _in_few_words(PresetError, lambda: from_bytes(head + body))


_KINDS = {
    "stick": Stick,
    "drum": Drum,
    "hand": Hand,
    "device": Device,
    "servo": Servo,
    "effects.pulse": Pulse,
}
_PLACES = [f"{table}.{key}" for table, kind in _KINDS.items() for key in quantities(kind)]
_PLACES += [
    "name", "words", "effects", "effects.pulse", "drum.effects", "listen.microphones", "mesh", "x", "stick.x",
    "stick.geometry", "stick.z_h0_m", "modal.modes", "guard",
]  # fmt: skip


@_EXAMPLES
@given(st.lists(st.tuples(st.sampled_from(_PLACES), _TOML), max_size=3))
def test_a_scene(entries: list[tuple[str, str]]) -> None:
    text = "".join(f"{place} = {value}\n" for place, value in entries)
    _in_few_words(SceneError, lambda: parse(text, "any.toml"))


@_EXAMPLES
@given(st.text(max_size=200))
def test_a_scene_of_any_text(text: str) -> None:
    _in_few_words(SceneError, lambda: parse(text, "any.toml"))


@pytest.mark.timeout(30)
def test_a_scene_of_one_endless_key() -> None:
    """Python's reader of TOML would need an hour for it."""
    with pytest.raises(SceneError, match="line 2 has more than 200 dots"):
        parse("\n" + ".".join("a" * 90_000) + " = 1", "any.toml")
    with pytest.raises(SceneError, match="more than 200000"):
        parse("#" * 10_000_000, "any.toml")


_RIG_PLACES = [
    "name", "zenoh", "zenoh.public", "zenoh.connect", "zenoh.roles", "zenoh.also", "keys", "keys.authority",
    "keys.certificate", "keys.private_key", "osc", "osc.bind", "osc.targets", "osc.allow", "x",
]  # fmt: skip


@_EXAMPLES
@given(
    st.lists(st.tuples(st.sampled_from(_RIG_PLACES), _TOML | _TOML.map(lambda text: f"[{text}]")), max_size=3)
)
def test_a_rig_file(entries: list[tuple[str, str]]) -> None:
    text = "".join(f"{place} = {value}\n" for place, value in entries)
    _in_few_words(RigFileError, lambda: parse_rig_file(text, "rig.toml", Path()))


def _values(found: object) -> dict[str, str]:
    return {name: json.dumps(value) for name, value in json.loads(json.dumps(found)).items()}


_WHOLE: dict[str, Any] = {
    "/strike": json.loads(as_json(a_strike(1))),
    "/release": json.loads(as_json(a_release(1))),
    "/choke": {"boot": 1, "seq": 1, "t_ns": 1, "source": "test"},
    "/state": json.loads(as_json(a_state(1))),
    "/contact": {"boot": 1, "seq": 1, "first_tick": 1, "rate_Hz": 1000.0, "forces_N": [1.0]},
    "/meter": {},
    "/param": {"value": 1.0, "revision": 1, "pending": False},
    "/alive": {"service": "a", "id": "b", "alive": True},
}


def _told(channel: Channel) -> st.SearchStrategy[tuple[Channel, str]]:
    whole = _WHOLE[channel.topic]
    texts = _some(_values(whole), _JSON).map(_object) if whole else _JSON
    return texts.map(lambda text: (channel, text))


@_EXAMPLES
@given(st.sampled_from(CHANNELS).flatmap(_told))
def test_a_message_of_a_recording(told: tuple[Channel, str]) -> None:
    channel, text = told
    _in_few_words(ValueError, lambda: from_json(channel, text.encode()))


_SCENE = _values(as_tables(Scene("any")))
_scene_texts = _some(_SCENE, _JSON) | st.sampled_from(sorted(_SCENE)).flatmap(
    lambda table: (
        _some(_values(json.loads(_SCENE[table])), _JSON).map(lambda inner: _SCENE | {table: _object(inner)})
        if _SCENE[table].startswith("{") and len(_SCENE[table]) > 2
        else st.just(_SCENE)
    )
)


@_EXAMPLES
@given(_scene_texts.map(_object) | _JSON)
def test_a_scene_in_a_recording(text: str) -> None:
    _in_few_words(ValueError, lambda: scene_of(text.encode()))


def _table(names: str, good: list[str]) -> st.SearchStrategy[str]:
    # Three rows, one or two of whose cells are odd.
    cells = st.dictionaries(st.integers(0, 3 * len(good) - 1), _CELLS, max_size=2)

    def text(odd: dict[int, str]) -> str:
        flat = [odd.get(at, cell) for at, cell in enumerate(good * 3)]
        rows = [",".join(flat[at : at + len(good)]) for at in range(0, len(flat), len(good))]
        return "\n".join([names, *rows]) + "\n"

    return cells.map(text)


@_EXAMPLES
@given(_table("t_s,z_m", ["0", "0"]) | st.text(max_size=100))
def test_a_gesture(text: str) -> None:
    _in_few_words(TrajectoryError, lambda: recording_of(text.splitlines(keepends=True), "any.csv"))


@_EXAMPLES
@given(_table("t_s,x,y,speed_m_per_s", ["0", "0", "0", "1"]) | st.text(max_size=100))
def test_a_table_of_strikes(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = tmp_path_factory.getbasetemp() / "any.csv"
    path.write_text(text, newline="")
    _in_few_words(CommandError, lambda: render.strikes_of(path, Scene("any")))


@_EXAMPLES
@given(_table("t_ns,span_s,z_m,v_m_per_s,force_N,told_z_m,fault", ["1", "0", "0", "0", "0", "0", "3"]))
def test_the_trace_of_a_fault(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    folder = tmp_path_factory.getbasetemp()
    (folder / files.TRACE).write_text(text, newline="")
    _in_few_words(last_fault.TraceError, lambda: last_fault.read(folder))


_RESULT = {
    "machine": '{"processor":"a","date":"b","quick":false}',
    "mesh": '{"rows":[{"ns_per_sample":1,"rms_cents":1,"measured":true}]}',
    "stick": '{"rows":[{"ns_per_s":1,"error_contacts":1}]}',
}


@_EXAMPLES
@given(
    _some(
        _RESULT, _JSON | _JSON.map(lambda text: '{"rows":[{"ns_per_s":' + text + ',"error_contacts":1}]}')
    ).map(_object)
)
def test_a_result_of_accuracy(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = tmp_path_factory.getbasetemp() / "accuracy.json"
    path.write_text(text)
    _in_few_words(ValueError, lambda: accuracy_results.read(path))
