"""Presets of the parameters: saved from what holds, loaded as one set through the envelope, restored at the start.

`save`, `rename` and `delete` wait for the disk; `load` and `list` only read. Any gateway thread.
"""

import logging
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from typing import NamedTuple

from drumstick.scenes.table import Z_H0, Refusal
from haptic_server.gateway.settings import Parameters
from haptic_server.presets.last_good import LastGood
from haptic_server.presets.preset import Preset, PresetError
from haptic_server.presets.store import LeftBehind, Listed, PresetStore
from protocol.messages import PresetNews, SetReply
from protocol.requests import Claim

_log = logging.getLogger("gateway")


class Loaded(NamedTuple):
    """A preset that was taken; `note` is not empty when it is an older version because the newest is damaged."""

    reply: SetReply
    note: str


def _utc() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


class Presets:
    """Presets of one scene. `scene_values`: the parameters as the scene gives them, before anybody set anything.

    `on_news` is called after a preset was saved, loaded, renamed or deleted, on the thread that did it.
    """

    def __init__(
        self,
        store: PresetStore,
        parameters: Parameters,
        scene_name: str,
        scene_values: Mapping[str, float],
        now: Callable[[], str] = _utc,
    ) -> None:
        self._store = store
        self.parameters = parameters
        self._scene_name = scene_name
        self._scene_values = _kept(scene_values)
        self._now = now
        self._noted = ""
        self.on_news: Callable[[PresetNews], None] = lambda _news: None

    def _preset(self, name: str, values: Mapping[str, float]) -> Preset:
        return Preset(name, self._scene_name, self._now(), _kept(values), self._scene_values)

    def save(self, name: str, source: str) -> Preset:
        """Keep what was accepted last under this name. Raises PresetError."""
        preset = self._preset(name, self.parameters.accepted_values())
        place = self._store.save(preset)
        _log.info("preset %s saved by %s in %s", name, source, place)
        self.on_news(PresetNews(what="saved", name=name))
        return preset

    def rename(self, name: str, new: str, source: str, claim: Claim) -> PresetNews:
        """Give a preset another name, with the version before it. Raises PresetError, or Refusal beside a lease."""
        self.parameters.require_free(claim)
        try:
            self._store.rename(name, new)
        except LeftBehind:
            self._publish(PresetNews(what="saved", name=new), source)
            raise
        return self._publish(PresetNews(what="renamed", name=new, before=name), source)

    def delete(self, name: str, source: str, claim: Claim) -> PresetNews:
        """Remove a preset, with the version before it. Raises PresetError, or Refusal beside a lease."""
        self.parameters.require_free(claim)
        self._store.delete(name)
        return self._publish(PresetNews(what="deleted", name=name), source)

    def _publish(self, news: PresetNews, source: str) -> PresetNews:
        _log.info("preset %s %s by %s", news.before or news.name, news.what, source)
        self.on_news(news)
        return news

    def load(self, name: str, source: str, claim: Claim) -> Loaded:
        """Set everything that the preset holds, or nothing. Raises PresetError or Refusal."""
        preset, note = self._store.load(name)
        strange = sorted(set(preset.values) - set(self.parameters.table))
        if strange:
            other = "an earlier version of " if preset.scene == self._scene_name else "the scene "
            raise Refusal(
                f"preset {name} is of {other}{preset.scene}; not in {self._scene_name}: {', '.join(strange)}"
            )
        reply = self.parameters.set(preset.values, f"preset {name} by {source}", claim)
        if note and note != self._noted:  # once, however often it is loaded
            self._noted = note
            _log.warning("preset %s: %s", name, note)
        self.on_news(PresetNews(what="loaded", name=name))
        return Loaded(reply, note)

    def list(self) -> list[Listed]:
        """All of the rig's, those of other scenes too. Raises PresetError."""
        return self._store.list()

    def restore(self) -> None:
        """Take up the last good set of this scene, and say in one line what became of it. Never raises."""
        try:
            found = self._store.load_last(self._scene_name)
            if found is None:
                return
            last = found.preset
            if self._is_changed_since(last.before):
                _log.warning(
                    "the scene was changed since: its own parameters are used, not those of last time"
                )
                return
            changed = {n: v for n, v in last.values.items() if v != self._scene_values.get(n)}
            if found.note:
                _log.warning("the last good set: %s", found.note)
            if changed:
                self.parameters.set(changed, "the last good set", Claim())
                changes = ", ".join(f"{n} {v:g}" for n, v in changed.items())
                _log.warning("as it was at %s: %s (--fresh starts from the scene)", last.saved_at, changes)
        except (PresetError, Refusal) as error:
            _log.warning("the scene's own parameters are used; the last good set cannot be: %s", error)

    def _is_changed_since(self, before: Mapping[str, float]) -> bool:
        # A parameter that came with an upgrade is no change of the scene: others of its part were there before.
        table = self.parameters.table
        parts = {table[name].effect for name in before if name in table}
        came = {name for name in self._scene_values.keys() - before.keys() if table[name].effect in parts}
        return before != {name: v for name, v in self._scene_values.items() if name not in came}

    def keep_last(self) -> LastGood:
        """Keep the last good set from now on."""
        return LastGood(self._store, lambda values: self._preset("last", values), self.parameters.values())


def _kept(values: Mapping[str, float]) -> dict[str, float]:
    # z_h0 is a view of z_ss and m and k_hand, and may not be set beside them.
    return {name: value for name, value in values.items() if name != Z_H0}
