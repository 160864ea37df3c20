"""A haptic side made of a Zenoh router and queryables: answers as the gateway does, remembers what it was asked."""

import json
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import zenoh
from rig_process import PATIENCE_S, is_subscribed, wait_for

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import as_tables
from drumstick.scenes.table import Refusal, table_of, values_of, with_changes
from drumstick.stick.law import law_of
from ports import free_port
from protocol.keys import Keys
from protocol.messages import (
    Clock,
    Cost,
    Lease,
    Membrane,
    Message,
    Meter,
    Pointer,
    PresetNews,
    PresetReply,
    Readback,
    RefusalReply,
    Release,
    SetReply,
    Spectrum,
    State,
    Strike,
    decode,
    encode,
)
from protocol.requests import Claim, requested_names, requested_text, requested_value, requested_values
from protocol.session import router_config


def wait_until(true: Callable[[], Any], what: str, timeout_s: float = PATIENCE_S) -> Any:
    """Poll until `true()` is truthy and return it; AssertionError says what did not come."""
    return wait_for(what, true, timeout_s)


class FakeRig:
    """Router, gateway and servo in one. `refuse` maps a parameter to the reason of its refusal; `latching` lets
    accepted values wait, as they do while the stick is in the head."""

    def __init__(self, scene: Scene, rig: str = "main", port: int | None = None, boot: int = 1) -> None:
        self.scene, self.boot = scene, boot
        self.table = table_of(scene)
        self.law = law_of(scene)
        self.keys = Keys(rig)
        self.port = free_port() if port is None else port
        self.endpoint = f"tcp/127.0.0.1:{self.port}"
        self.refuse: dict[str, str] = {}
        self.latching = False
        self.sounding = True  # a sound server is there
        self.limiting, self._limited = False, 0  # the sound server's limiter bends what leaves; frames so far
        self.losing = False  # the readbacks of `latch` get lost
        self.pending: dict[str, float] = {}
        self.sets: list[tuple[str, float]] = []
        self.whole_sets: list[dict[str, float]] = []
        self.rolls: list[dict[str, float]] = []
        self.panics = 0
        self.presets: dict[str, dict[str, float]] = {}
        self.claims: list[Claim] = []  # of renamed and deleted presets
        self.lease_of = ""
        self.status = "playing"
        self.revision = 0
        self.strikes = 0
        self._revisions = dict.fromkeys(self.table, 0)
        self._lock = threading.RLock()
        self._mute = threading.Event()
        self._ended = threading.Event()
        self._session = zenoh.open(router_config(self.endpoint))
        k = self.keys
        for key, answer in (
            (k.scene, self._answer_scene),
            (k.clock, self._answer_clock),
            (k.param("*"), self._answer_readbacks),
            (k.set_one("*"), self._answer_set),
            (k.set_many, self._answer_set_many),
            (k.play_roll, self._answer_roll),
            (k.panic, self._answer_panic),
            (k.preset, self._answer_presets),
            (k.preset_load, self._answer_load),
            (k.preset_save, self._answer_save),
            (k.preset_rename, self._answer_rename),
            (k.preset_delete, self._answer_delete),
            (k.lease, self._answer_lease),
            (k.doctor, self._answer_doctor),
        ):
            self._session.declare_queryable(key, answer)
        self._watched = {
            key: self._session.declare_publisher(key)
            for key in (k.membrane, k.spectrum, k.cost, k.strike, k.release)
        }
        self.pointers: list[Pointer] = []
        self._session.declare_subscriber(
            k.pointer, lambda sample: self.pointers.append(decode(sample.payload.to_bytes(), Pointer))
        )
        self._pointer_token: zenoh.LivelinessToken | None = None
        self._thread = threading.Thread(target=self._publish, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the router and all; closing twice is no mistake."""
        self._ended.set()
        self._thread.join()
        self._session.close()

    def begin_again(self) -> None:
        """As its scene has it, playing, and nothing was asked yet; presets stay."""
        self.refuse.clear()
        self.latching = self.losing = self.limiting = False
        self._limited = 0
        self.sounding, self.status = True, "playing"
        self.mute(False)
        self.follow_pointer(False)
        with self._lock:
            self.pending.clear()
            self.law = law_of(self.scene)
            for name in self.table:
                self.revision += 1
                self._revisions[name] = self.revision
                self._session.put(self.keys.param(name), encode(self._readback(name)))
        self.publish_lease("")
        self.sets.clear()
        self.whole_sets.clear()
        self.rolls.clear()
        self.claims.clear()
        self.pointers.clear()
        self.panics = 0

    def mute(self, muted: bool) -> None:
        """Stop publishing, as a haptic server does that was killed while the router lives on."""
        (self._mute.set if muted else self._mute.clear)()

    def follow_pointer(self, follows: bool) -> None:
        """Say that the stick follows a pointer, or no more."""
        if follows:
            key = self.keys.alive("pointer", f"{self.boot:x}")
            self._pointer_token = self._session.liveliness().declare_token(key)
        elif self._pointer_token is not None:
            self._pointer_token.undeclare()
            self._pointer_token = None

    def latch(self) -> None:
        """The stick is above the head: what waited holds."""
        with self._lock:
            names = list(self.pending)
            self.law = with_changes(self.law, self.table, self.pending)
            self.pending.clear()
            if not self.losing:
                for name in names:
                    self._session.put(self.keys.param(name), encode(self._readback(name)))

    def value(self, name: str) -> float:
        return values_of(self.law, self.table)[name]

    def set_elsewhere(self, name: str, value: float) -> None:
        """Another client, OSC say, sets a value."""
        with self._lock:
            self._accept(name, value)

    def lose(self, name: str, value: float) -> None:
        """Accept a value, but its readback gets lost: only State tells that there is a newer revision."""
        with self._lock:
            self.law = with_changes(self.law, self.table, {name: value})
            self.revision += 1
            self._revisions[name] = self.revision

    def _accept(self, name: str, value: float) -> Readback:
        changed = with_changes(self.law, self.table, {name: value})
        self.revision += 1
        self._revisions[name] = self.revision
        if self.latching:
            self.pending[name] = value
        else:
            self.law = changed
        readback = self._readback(name)
        self._session.put(self.keys.param(name), encode(readback))
        return readback

    def _readback(self, name: str) -> Readback:
        return Readback(value=self.value(name), revision=self._revisions[name], pending=name in self.pending)

    def _answer_scene(self, query: zenoh.Query) -> None:
        query.reply(self.keys.scene, json.dumps(as_tables(self.scene)))

    def _answer_clock(self, query: zenoh.Query) -> None:
        query.reply(self.keys.clock, encode(Clock(boot=self.boot, t_ns=time.monotonic_ns())))

    def _answer_readbacks(self, query: zenoh.Query) -> None:
        with self._lock:
            for name in self.table:
                query.reply(self.keys.param(name), encode(self._readback(name)))

    def _answer_set(self, query: zenoh.Query) -> None:
        name = str(query.key_expr).rpartition("/")[2]
        assert query.payload is not None
        with self._lock:
            try:
                value, _ = requested_value(query.payload.to_bytes())
                self.sets.append((name, value))
                if name in self.refuse:
                    raise Refusal(self.refuse[name])
                taken = self._accept(name, value)
                if taken.pending:  # the answer tells what will hold
                    taken = Readback(value=value, revision=taken.revision, pending=True)
                query.reply(query.key_expr, encode(taken))
            except ValueError as error:
                query.reply_err(encode(RefusalReply(reason=str(error))))

    def _answer_set_many(self, query: zenoh.Query) -> None:
        assert query.payload is not None
        with self._lock:
            values, _ = requested_values(query.payload.to_bytes())
            self.whole_sets.append(values)
            for name, value in values.items():
                self._accept(name, value)
            reply = SetReply(values=values, revision=self.revision, pending=bool(self.pending))
            query.reply(self.keys.set_many, encode(reply))

    def _answer_roll(self, query: zenoh.Query) -> None:
        assert query.payload is not None
        with self._lock:
            asked, _ = requested_values(query.payload.to_bytes())
            self.rolls.append(asked)
            if asked.get("rate", 0.0) > 60.0:
                query.reply_err(encode(RefusalReply(reason="it cannot be met; nearest: 55 Hz at level 0.28")))
                return
            values = {"k_hand": asked.get("rate", 20.0)}
            for name, value in values.items():
                self._accept(name, value)
            reply = SetReply(values=values, revision=self.revision, pending=False)
            query.reply(self.keys.play_roll, encode(reply))

    def _answer_presets(self, query: zenoh.Query) -> None:
        listed = [{"name": n, "scene": "roll", "saved_at": "now", "trouble": ""} for n in self.presets]
        query.reply(self.keys.preset, json.dumps(listed))

    def _answer_load(self, query: zenoh.Query) -> None:
        assert query.payload is not None
        name, _ = requested_text(query.payload.to_bytes())
        with self._lock:
            if name not in self.presets:
                query.reply_err(encode(RefusalReply(reason=f"no preset {name!r}")))
                return
            for parameter, value in self.presets[name].items():
                self._accept(parameter, value)
            reply = PresetReply(name=name, values=self.presets[name], revision=self.revision, pending=False)
            query.reply(self.keys.preset_load, encode(reply))

    def _answer_save(self, query: zenoh.Query) -> None:
        assert query.payload is not None
        name, _ = requested_text(query.payload.to_bytes())
        with self._lock:
            self.presets[name] = {n: self.value(n) for n in ("dv_pls", "k_coll")}
        self._tell_news(query, PresetNews(what="saved", name=name))

    def somebody_keeps(self, presets: dict[str, dict[str, float]]) -> None:
        """Have these presets and no others, as if another client had saved and deleted, and tell it."""
        with self._lock:
            self.presets = presets
        self._session.put(self.keys.preset, encode(PresetNews(what="deleted", name="another")))

    def _answer_rename(self, query: zenoh.Query) -> None:
        assert query.payload is not None
        name, new, claim = requested_names(query.payload.to_bytes())
        with self._lock:
            self.claims.append(claim)
            if name not in self.presets or new in self.presets:
                query.reply_err(encode(RefusalReply(reason=f"no preset {name!r}, or {new!r} is there")))
                return
            self.presets[new] = self.presets.pop(name)
        self._tell_news(query, PresetNews(what="renamed", name=new, before=name))

    def _answer_delete(self, query: zenoh.Query) -> None:
        assert query.payload is not None
        name, claim = requested_text(query.payload.to_bytes())
        with self._lock:
            self.claims.append(claim)
            if self.presets.pop(name, None) is None:
                query.reply_err(encode(RefusalReply(reason=f"no preset {name!r}")))
                return
        self._tell_news(query, PresetNews(what="deleted", name=name))

    def _tell_news(self, query: zenoh.Query, news: PresetNews) -> None:
        query.reply(query.key_expr, encode(news))
        self._session.put(self.keys.preset, encode(news))

    def _answer_lease(self, query: zenoh.Query) -> None:
        query.reply(self.keys.lease, encode(Lease(name=self.lease_of, left_s=5.0)))

    def publish_lease(self, name: str) -> None:
        """Somebody takes the lease, or ("") gives it back."""
        self.lease_of = name
        self._session.put(self.keys.lease, encode(Lease(name=name, left_s=5.0 if name else 0.0)))

    def _answer_doctor(self, query: zenoh.Query) -> None:
        query.reply(
            self.keys.doctor, json.dumps({"lateness": {"bin_us": 10.0, "ticks": [80_000_000, 700, 0, 3]}})
        )

    def watched(self) -> set[str]:
        """Keys that somebody subscribes to, of those that are put only then: their last parts."""
        return {
            key.rpartition("/")[2] for key, publisher in self._watched.items() if is_subscribed(publisher)
        }

    def _tell(self, key: str, message: Message) -> None:
        if key.rpartition("/")[2] in self.watched():
            self._watched[key].put(encode(message))

    def _answer_panic(self, query: zenoh.Query) -> None:
        self.panics += 1
        self.status = "panic"
        query.reply(self.keys.panic, b"")

    def _publish(self) -> None:
        while not self._ended.wait(1.0 / 30.0):
            if self._mute.is_set():
                continue
            with self._lock:
                self.strikes += 1
                self._tell(self.keys.strike, self._strike())
                self._session.put(self.keys.state, encode(self._state()))
                self._tell(self.keys.release, self._release())
                if self.sounding:
                    self._sound()

    def _sound(self) -> None:
        self._session.put(self.keys.meter, encode(self._meter()))
        self._tell(self.keys.membrane, self._membrane())
        self._tell(self.keys.spectrum, self._spectrum())
        for accuracy, share in (("now", 1.0), ("fine", 4.0)):
            self._tell(self.keys.cost, self._cost(accuracy, share))

    def _strike(self) -> Strike:
        return Strike(
            boot=self.boot, seq=self.strikes, t_ns=time.monotonic_ns(), x=0.3, y=0.2, z_speed_m_per_s=0.63,
            level=0.31, peak_estimate_N=5.4, contact_estimate_s=0.0055, impulse_N_s=0.015,
        )  # fmt: skip

    def _release(self) -> Release:
        return Release(
            boot=self.boot, seq=self.strikes, t_ns=time.monotonic_ns(), exit_speed_m_per_s=0.43, impulse_N_s=0.015,
            peak_N=5.4, contact_s=0.0055,
        )  # fmt: skip

    def _membrane(self) -> Membrane:
        heights = np.zeros(1 + 8 * 24, "<i2")
        heights[: 1 + 24] = 1000 * (self.strikes % 9 - 4)
        return Membrane(
            id="s1", t_ns=time.monotonic_ns(), rings=8, spokes=24, unit_m=1e-6, heights=heights.tobytes()
        )

    def _spectrum(self) -> Spectrum:
        levels = np.full(240, -80.0, "<f4")
        levels[30] = -12.0
        return Spectrum(
            id="s1", t_ns=time.monotonic_ns(), top_Hz=1200.0, window_s=0.34, levels=levels.tobytes()
        )

    def _cost(self, accuracy: str, share: float) -> Cost:
        return Cost(
            id="s1", words="mesh of 66.7 junctions across", accuracy=accuracy, mesh_rate_Hz=16000.0, across=66.7,
            share=share, cents=0.4,
        )  # fmt: skip

    def _state(self) -> State:
        playing = self.status == "playing"
        return State(
            boot=self.boot, t_ns=time.monotonic_ns(), status=self.status, z_m=0.01, v_m_per_s=0.1, force_N=0.0,
            x=0.3, y=0.2, roll_rate_Hz=23.05 if playing else 0.0, v_e_m_per_s=0.628 if playing else 0.0,
            strikes=self.strikes, ticks=1000, overruns=2, lateness_p99_us=110.0, lateness_worst_us=289.0,
            ring_dropped=0, revision=self.revision, pending=bool(self.pending),
        )  # fmt: skip

    def _meter(self) -> Meter:
        self._limited += 10 * self.limiting
        return Meter(
            id="s1", t_ns=time.monotonic_ns(), sink="null", peak_left=0.5, peak_right=0.4, load=0.21, xruns=7,
            latency_ms=5.3, played=self.strikes, late=0, duplicates=0, output_peak=0.5, output_rms=0.125,
            limited_frames=self._limited,
        )  # fmt: skip
