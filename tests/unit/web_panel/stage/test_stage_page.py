"""The stage page: one file, whose policy lets it load nothing and talk to its own panel only."""

import base64
import hashlib
import re

from web_panel.stage.stage_page import stage_page


def test_the_policy_admits_the_pages_own_script_and_style_and_nothing_else() -> None:
    page = stage_page("main")
    text = page.html.decode()
    for tag in ("script", "style"):
        ((inside),) = re.findall(rf"<{tag}[^>]*>(.*?)</{tag}>", text, re.DOTALL)
        digest = base64.b64encode(hashlib.sha256(inside.encode()).digest()).decode()
        assert f"{tag}-src 'sha256-{digest}'" in page.policy
    assert re.findall(r"(\S+-src)", page.policy) == [
        "default-src", "script-src", "style-src", "img-src", "connect-src",
    ]  # fmt: skip
    assert page.policy.startswith("default-src 'none'; ")
    assert page.policy.endswith("img-src data:; connect-src {websocket}")


def test_it_names_no_other_place_and_sends_nothing() -> None:
    text = stage_page("main").html.decode()
    assert not re.search(r"https?:|//\w+\.|\.send\(|fetch\(|XMLHttpRequest|sendBeacon", text)


def test_a_rigs_name_is_text() -> None:
    assert b'<p id="rig">&lt;b&gt;&quot;</p>' in stage_page('<b>"').html
