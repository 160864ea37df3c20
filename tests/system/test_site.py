"""The documentation site: made without a warning, whole links, readable by everybody, and without a network."""

import json
import random
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from axe_playwright_python.sync_playwright import Axe
from browser import DESKTOP, PATIENCE_MS, PHONE
from playwright.sync_api import Browser, Page, expect

ROOT = Path(__file__).resolve().parents[2]
DOORS = ["index", "player", "technician", "researcher", "reference", "results", "project"]
FOLDERS = [".", "daw", "decisions", "source"]
OTHERS = [
    "api",
    "accuracy-and-time",
    "sounds",
    "scenes",
    "daw/README",
    "search",
    "source/tests/stability/wire/test_network.py",
]


def _sphinx(builder: str, pages: Path, out: Path) -> subprocess.CompletedProcess[str]:
    options = ["-W", "--keep-going", "-q", "-b", builder, "-c", ROOT / "docs/site", "-d", out / "doctrees"]
    return subprocess.run(
        [sys.executable, "-m", "sphinx", *options, pages, out / "site"],
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, made once for this module."""
    out = tmp_path_factory.mktemp("site")
    made = _sphinx("html", ROOT / "docs", out)
    assert (made.returncode, made.stderr) == (0, "")
    return out / "site"


class _Seen(HTMLParser):
    """Names that can be linked to in a page, its links, and what a browser loads for it."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.names, self.links, self.loaded = set[str](), set[str](), set[str]()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.names.add(given.get("id", ""))
        if tag == "a" and "href" in given:
            self.links.add(given["href"])
        elif address := given.get("src") or (tag == "link" and given["href"]):
            self.loaded.add(str(address))


@pytest.mark.long
@pytest.mark.timeout(1800)  # all pages are made first
def test_every_link_leads_somewhere_and_nothing_is_loaded_from_elsewhere(site: Path) -> None:
    seen = {path: _Seen(path) for path in site.rglob("*.html") if "_static" not in path.parts}
    assert len(seen) > 100
    broken: list[str] = []
    for path, page in seen.items():
        away = {address for address in page.links if urlsplit(address).scheme}
        for address in page.links - away | page.loaded:
            parts = urlsplit(address)
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.is_file() or (parts.fragment and unquote(parts.fragment) not in seen[target].names):
                broken.append(f"{path.relative_to(site)}: {address}")
    assert broken == []


@pytest.mark.parametrize("page", sorted(ROOT.glob("*.md")), ids=lambda path: path.stem)
def test_pages_at_the_root_link_to_what_is_there(page: Path) -> None:
    links = re.findall(r"\]\(([^)#\s]+)[^)]*\)", page.read_text(encoding="utf-8"))
    assert [link for link in links if not urlsplit(link).scheme and not (ROOT / link).exists()] == []


def test_the_readme_is_short_and_has_the_three_doors() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(readme.splitlines()) < 150
    assert all(f"(docs/{door}.md)" in readme for door in ("player", "technician", "researcher"))


def test_a_page_that_no_list_names_and_a_link_to_nothing_stop_it(tmp_path: Path) -> None:
    pages = tmp_path / "docs"
    pages.mkdir()
    (pages / "index.md").write_text("# Front\n\n## Doors\n\n- [Listed](listed.md): yes\n")
    (pages / "listed.md").write_text("# Listed\n\n[nothing](gone.md), [no heading](listed.md#gone)\n")
    assert _sphinx("dummy", pages, tmp_path).stderr.count("WARNING") == 2
    (pages / "listed.md").write_text("# Listed\n")
    assert _sphinx("dummy", pages, tmp_path).returncode == 0
    (pages / "forgotten.md").write_text("# Forgotten\n")
    made = _sphinx("dummy", pages, tmp_path)
    assert made.returncode != 0
    assert "forgotten.md: WARNING: document isn't included in any toctree" in made.stderr


@contextmanager
def _reader(browser: Browser, size: tuple[int, int]) -> Iterator[tuple[Page, list[str]]]:
    """A page without a network, and what it asks of other machines."""
    context = browser.new_context(viewport={"width": size[0], "height": size[1]}, offline=True)
    context.set_default_timeout(PATIENCE_MS)
    page, asked = context.new_page(), list[str]()
    page.on("request", lambda request: asked.append(request.url))
    try:
        yield page, asked
    finally:
        context.close()


def _hindrances(page: Page, path: Path) -> list[str]:
    """Findings of axe that are serious or critical, and a page that must be moved sideways."""
    page.goto(path.as_uri())
    found = Axe().run(page).response["violations"]
    wide = page.evaluate("document.documentElement.scrollWidth > innerWidth")
    return [each["id"] for each in found if each["impact"] in ("serious", "critical")] + ["too wide"] * wide


def _due(site: Path, folder: str, whole: bool) -> list[Path]:
    """The folder's pages, or the first of them and a tenth: the same ones as long as no page's text changes."""
    pages = sorted(path for path in (site / folder).rglob("*.html") if "_static" not in path.parts)
    if folder == ".":
        pages = [path for path in pages if path.parent == site]
    drawn = random.Random((site / "searchindex.js").read_bytes())
    return pages if whole else [pages[0], *drawn.sample(pages[1:], len(pages) // 10)]


@pytest.mark.long
@pytest.mark.timeout(1800)  # source: 50 pages of code, a minute alone, ten beside much else
@pytest.mark.parametrize("folder", FOLDERS)
def test_nothing_serious_keeps_anybody_from_reading_any_page(
    request: pytest.FixtureRequest, site: Path, browser: Browser, folder: str
) -> None:
    """`make test-long` reads every page; a slice of it some of each folder, where all have one form."""
    pages = _due(site, folder, whole=request.config.getoption("slice") == "all")
    with _reader(browser, DESKTOP) as (page, asked):
        found = {path.relative_to(site): _hindrances(page, path) for path in pages}
    assert {name: each for name, each in found.items() if each} == {}
    assert {urlsplit(address).scheme for address in asked} <= {"file", "data"}


@pytest.mark.long
def test_every_page_is_in_a_folder_that_is_read(site: Path) -> None:
    pages = {path for path in site.rglob("*.html") if "_static" not in path.parts}
    assert pages == {path for folder in FOLDERS for path in _due(site, folder, whole=True)}
    assert {site / f"{name}.html" for name in DOORS} <= pages


@pytest.mark.long
@pytest.mark.parametrize("name", [*DOORS, *OTHERS])
def test_a_page_is_read_on_a_phone(site: Path, browser: Browser, name: str) -> None:
    with _reader(browser, PHONE) as (page, asked):
        assert _hindrances(page, site / f"{name}.html") == []
        assert {urlsplit(address).scheme for address in asked} <= {"file", "data"}


@pytest.mark.long
def test_each_choice_of_the_whole_way_is_read_by_pointer_and_by_keyboard(
    site: Path, browser: Browser
) -> None:
    rows = json.loads((ROOT / "lab/results/accuracy.json").read_text(encoding="utf-8"))["whole"]["rows"]
    drawn = [row for row in rows if row["share_of_core"] is not None and row["stage"] != "reference"]
    with _reader(browser, DESKTOP) as (page, asked):
        assert _hindrances(page, site / "accuracy-and-time.html") == []
        marks = page.get_by_role("img").and_(page.locator(".choice"))
        assert marks.count() == len(drawn)
        said = [mark.locator("title").text_content() for mark in marks.all()]
        for row in drawn:
            begin = f"{row['stage']}: {row['choice']} ({row['playing']}). "
            assert sum(str(each).startswith(begin) for each in said) == 1
        first, second, last = (marks.nth(at).locator(".words") for at in (0, 1, len(drawn) - 1))
        marks.first.focus()
        expect(first).to_be_visible()
        page.keyboard.press("Tab")
        expect(second).to_be_visible()
        expect(first).to_be_hidden()
        marks.last.locator(".ring").hover()
        expect(last).to_be_visible()
        expect(second).to_be_hidden()
        assert {urlsplit(address).scheme for address in asked} <= {"file", "data"}


@pytest.mark.long
def test_a_word_is_found_without_a_network(site: Path, browser: Browser) -> None:
    with _reader(browser, DESKTOP) as (page, _):
        page.goto((site / "index.html").as_uri())
        page.keyboard.press("Control+k")
        page.keyboard.type("restitution")
        page.keyboard.press("Enter")
        expect(page.locator("#search-results a[href*='servo.html']").first).to_be_visible(timeout=PATIENCE_MS)
