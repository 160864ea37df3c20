import stat
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from web_panel.access.visitor_token import TokenFileError, token_of


def test_it_is_made_once_for_its_owner_only(tmp_path: Path) -> None:
    path = tmp_path / "folder" / "token"
    token = token_of(path)
    assert len(token) >= 43
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert token_of(path) == token
    assert [p.name for p in path.parent.iterdir()] == ["token"]


def test_two_panels_that_start_at_once_agree(tmp_path: Path) -> None:
    path = tmp_path / "token"
    with ThreadPoolExecutor(8) as pool:
        assert len(set(pool.map(token_of, [path] * 32))) == 1


@pytest.mark.parametrize("content", ["", "short", "a" * 42 + "\n" + "b", "ä" * 43, "a b" * 20])
def test_a_file_without_a_token_is_refused_with_a_remedy(tmp_path: Path, content: str) -> None:
    path = tmp_path / "token"
    path.touch(mode=0o600)
    path.write_text(content, encoding="utf-8")
    with pytest.raises(TokenFileError, match="token file"):
        token_of(path)


def test_a_file_that_others_can_read_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "token"
    token_of(path)
    path.chmod(0o640)
    with pytest.raises(TokenFileError, match="chmod 600"):
        token_of(path)


def test_a_folder_in_its_place_is_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o700)
    with pytest.raises(TokenFileError, match="directory"):
        token_of(tmp_path)
