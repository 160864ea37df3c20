"""A file that somebody named is read at once, up to a limit, or refused at once."""

import os
from pathlib import Path

import pytest

from realtime.regular_file import created, opened, read_bytes, read_text, write_text


def test_a_file_as_large_as_the_limit_is_read_and_a_larger_one_is_not(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"12345")
    assert read_bytes(path, 5) == b"12345"
    with pytest.raises(OSError, match="more than 4 bytes"):
        read_bytes(path, 4)
    with pytest.raises(OSError, match="more than 4 bytes"):
        opened(path, 4)


def test_a_file_that_tells_no_size_is_read_up_to_the_limit_too() -> None:
    assert Path("/proc/self/status").stat().st_size == 0
    with pytest.raises(OSError, match="more than 10 bytes"):
        read_bytes(Path("/proc/self/status"), 10)


@pytest.mark.timeout(20)
def test_what_is_no_file_is_refused_at_once(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    link = tmp_path / "link"
    link.symlink_to("/dev/zero")
    for path in (pipe, link, Path("/dev/zero"), Path("/dev/random"), Path("/dev/null")):
        with pytest.raises(OSError, match="not a regular file"):
            read_bytes(path, 10)
    with pytest.raises(IsADirectoryError):
        read_bytes(tmp_path, 10)
    with pytest.raises(FileNotFoundError):
        read_bytes(tmp_path / "none", 10)


def test_text_is_utf_8_with_any_line_ends(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes("ä\r\nb\rc\n".encode())
    assert read_text(path, 100) == "ä\nb\nc\n"
    path.write_bytes(b"\xff")
    with pytest.raises(UnicodeDecodeError):
        read_text(path, 100)


def test_a_file_is_written_new_or_over_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "a"
    for text in ("a long first text", "short"):
        write_text(path, text)
        assert path.read_text(encoding="utf-8") == text
    descriptor = created(path)
    assert not os.get_inheritable(descriptor)
    os.close(descriptor)
    assert path.read_bytes() == b""


@pytest.mark.timeout(20)
def test_what_is_no_file_is_not_written_and_holds_nobody_up(tmp_path: Path) -> None:
    unread, read = tmp_path / "unread", tmp_path / "read"
    os.mkfifo(unread)
    os.mkfifo(read)
    reader = os.open(read, os.O_RDONLY | os.O_NONBLOCK)
    for path in (unread, read, Path("/dev/null")):
        with pytest.raises(OSError, match="not a regular file"):
            write_text(path, "a text")
    assert os.read(reader, 10) == b""
    os.close(reader)
    with pytest.raises(IsADirectoryError):
        created(tmp_path)
