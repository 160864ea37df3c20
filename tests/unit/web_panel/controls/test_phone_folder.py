"""The login link on the page of this machine: shown anew when it changes, drawn no oftener."""

from types import SimpleNamespace
from typing import Any

import pytest

from web_panel.access.lan_admission import LanAdmission
from web_panel.access.one_time_login import OneTimeLogin
from web_panel.controls.phone_folder import PhoneFolder
from web_panel.page import qr_code


class Clock:
    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def test_the_code_is_drawn_when_the_link_or_its_minutes_change(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[str] = []
    monkeypatch.setattr(qr_code, "picture", lambda link, _name: drawn.append(link) or f"code of {link}")
    clock = Clock()
    login = OneTimeLogin(clock)
    lan: Any = SimpleNamespace(admission=LanAdmission("a" * 43, 8443, host="192.168.1.10", login=login))
    server: Any = SimpleNamespace(on_client_connect=lambda _: None, on_client_disconnect=lambda _: None)
    folder = PhoneFolder(server, SimpleNamespace(controls={}), lan, 0.0)  # pyright: ignore[reportArgumentType]
    link: Any = SimpleNamespace(content="")
    folder._shown[1] = link, "its button"
    folder.show()
    assert "No login link is valid" in link.content
    for _ in range(2):
        login.renew()
        for _ in range(100):
            folder.show()
        assert drawn[-1] == lan.admission.open_link
        assert drawn[-1] in link.content
        assert "within 10 min" in link.content
    assert len(drawn) == 2
    clock.now_s += 1.0
    folder.show()
    clock.now_s += 60.0
    folder.show()
    assert "within 9 min" in link.content
    assert len(drawn) == 3
