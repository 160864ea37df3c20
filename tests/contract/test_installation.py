"""`make install` and its scripts: what they ask of the system, and what they do where they may not."""

import ast
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import venv
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
import yaml
from typer.testing import CliRunner

from rig.cli.command import app
from rig.exit_status import CommandError

ROOT = Path(__file__).resolve().parents[2]
DEPLOY = ROOT / "deploy"
SCRIPTS = [*sorted(DEPLOY.glob("*.sh")), DEPLOY / "drumstick-at", ROOT / ".ci" / "run"]
PACKAGES = """# A list like the real one.
# section: play
alpha-lib   # have: test -e "$HERE/alpha"
# section: test
beta-tool   # have: command -v no-such-program-beta
gamma-tool  # have: command -v bash
"""


class Machine:
    """A machine of stand-ins: who one is, and what apt and sudo answer. What they are asked is written down."""

    def __init__(self, folder: Path) -> None:
        self.bin, self.asked = folder / "bin", folder / "asked"
        self.here, self.deploy = folder / "here", folder / "deploy"
        for made in (self.bin, self.here, self.deploy):
            made.mkdir()
        self.asked.touch()
        shutil.copy(DEPLOY / "install-system.sh", self.deploy)
        (self.deploy / "system-packages.txt").write_text(PACKAGES, encoding="utf-8")
        for program in ("bash", "dirname", "env", "true"):
            (self.bin / program).symlink_to(shutil.which(program) or program)
        self.stands_in("id", "echo 0")
        self.stands_in("dpkg-query", "exit 1")
        self.stands_in("apt-get", 'echo "apt-get $DEBIAN_FRONTEND $*" >> "$ASKED"')

    def stands_in(self, program: str, script: str) -> None:
        """Put a program on this machine's PATH."""
        path = self.bin / program
        path.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
        path.chmod(0o755)

    def install(self, *sections: str) -> subprocess.CompletedProcess[str]:
        """Run the script; it never fails."""
        environment = {"PATH": str(self.bin), "ASKED": str(self.asked), "HERE": str(self.here)}
        done = subprocess.run(
            ["bash", str(self.deploy / "install-system.sh"), *sections],
            env=environment, capture_output=True, text=True, check=False, timeout=60,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done

    @property
    def calls(self) -> list[str]:
        return self.asked.read_text(encoding="utf-8").splitlines()


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


def test_root_gets_what_is_missing_of_the_section_and_is_asked_nothing(machine: Machine) -> None:
    machine.install("play")
    update, install = machine.calls
    assert re.search(r"^apt-get noninteractive .*update$", update)
    assert re.search(r"^apt-get noninteractive .*install -y --no-install-recommends alpha-lib$", install)


def test_sections_add_up_and_what_is_there_is_left_alone(machine: Machine) -> None:
    machine.install("play", "test")
    assert machine.calls[-1].endswith("--no-install-recommends alpha-lib beta-tool")


def test_nothing_is_run_when_all_is_there(machine: Machine) -> None:
    (machine.here / "alpha").touch()
    done = machine.install("play")
    assert machine.calls == []
    assert done.stdout + done.stderr == ""


def test_what_debian_has_but_nobody_finds_is_not_installed_again(machine: Machine) -> None:
    machine.stands_in("dpkg-query", "echo installed")
    assert "alpha-lib" in machine.install("play").stderr
    assert machine.calls == []


@pytest.mark.parametrize("sudo", [None, "exit 1"])
def test_who_may_not_is_told_the_line_to_type(machine: Machine, sudo: str | None) -> None:
    machine.stands_in("id", "echo 1000")
    if sudo is not None:
        machine.stands_in("sudo", sudo)
    said = machine.install("play", "test").stderr
    assert "\n  sudo apt-get install --no-install-recommends alpha-lib beta-tool\n" in said
    assert machine.calls == []


def test_sudo_that_asks_no_password_is_used(machine: Machine) -> None:
    machine.stands_in("id", "echo 1000")
    machine.stands_in("sudo", 'shift; echo "sudo $1" >> "$ASKED"; exec "$@"')
    machine.install("play")
    assert [call for call in machine.calls if call.startswith("sudo")] == [
        "sudo true",
        "sudo env",
        "sudo env",
    ]
    assert machine.calls[-1].endswith("install -y --no-install-recommends alpha-lib")


def test_an_apt_that_fails_is_not_the_end(machine: Machine) -> None:
    machine.stands_in("apt-get", "exit 100")
    assert "could not be installed: alpha-lib" in machine.install("play").stderr


def test_another_system_is_told_what_it_lacks(machine: Machine) -> None:
    (machine.bin / "apt-get").unlink()
    assert "alpha-lib" in machine.install("play").stderr


@pytest.mark.needs("shellcheck")
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
def test_shellcheck_has_nothing_to_say(script: Path) -> None:
    # -x: also what a script reads with `.`, named from the checkout.
    done = subprocess.run(["shellcheck", "-x", script], capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stdout
    assert os.access(script, os.X_OK)


@pytest.mark.parametrize("lock", ["requirements.lock", "requirements-dev.lock"])
def test_every_dependency_is_locked_with_its_hashes(lock: str) -> None:
    """Each package of pyproject.toml has a version and a hash; no line names where packages come from."""
    text = (ROOT / lock).read_text(encoding="utf-8")
    blocks = re.split(r"^(?=[a-z0-9])", text, flags=re.MULTILINE)[1:]
    locked = {block.split("==")[0]: block for block in blocks}
    assert all("--hash=sha256:" in block for block in locked.values())
    assert not re.search(r"^\s*(--\w*index|--find-links|-f\b|-i\b)|://", text, flags=re.MULTILINE)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    wanted = list(project["project"]["dependencies"])
    for extra in project["project"]["optional-dependencies"].values():
        wanted += extra
    groups = project["dependency-groups"]
    wanted += groups["build"]
    if lock == "requirements-dev.lock":
        wanted += [name for name in groups["dev"] if isinstance(name, str)]
    names = {re.split(r"[\[<>=!~ ]", requirement)[0] for requirement in wanted}
    names -= {project["project"]["name"]}  # `all` is the other extras
    assert names <= set(locked), names - set(locked)


def test_both_locks_agree() -> None:
    pins = [
        dict(
            re.findall(r"^([a-z0-9-]+)==(\S+)", (ROOT / lock).read_text(encoding="utf-8"), flags=re.MULTILINE)
        )
        for lock in ("requirements.lock", "requirements-dev.lock")
    ]
    assert pins[0].items() <= pins[1].items()


def test_every_program_that_a_test_needs_has_its_package() -> None:
    """Programs that `needs(...)` names anywhere in the suite stand in system-packages.txt."""
    listed = set(
        re.findall(r"command -v (\S+)", (DEPLOY / "system-packages.txt").read_text(encoding="utf-8"))
    )
    for path in (ROOT / "tests").rglob("test_*.py"):
        for names in re.findall(r"mark\.needs\(([^)]*)\)", path.read_text(encoding="utf-8")):
            assert set(re.findall(r"[\"']([^\"']+)[\"']", names)) <= listed, path


class TestBorrowing:
    """deploy/borrow.sh: an environment for the services, from one that somebody made."""

    def borrowed(self, source: Path, to: Path, *how: str) -> subprocess.CompletedProcess[str]:
        environment = dict(os.environ, PYTHON=os.path.realpath(sys.executable))
        return subprocess.run(
            [DEPLOY / "borrow.sh", source, to, "/stage/venv", *how], env=environment, capture_output=True, text=True,
            check=False, timeout=120,
        )  # fmt: skip

    def made(self, folder: Path) -> Path:
        venv.create(folder, symlinks=True)
        program = folder / "bin" / "program"
        program.write_text(f"#!{folder}/bin/python\n")
        program.chmod(0o777)
        return folder

    def as_it_should(self, to: Path) -> None:
        assert (to / "bin" / "program").read_text() == "#!/stage/venv/bin/python\n"
        assert f"home = {Path(os.path.realpath(sys.executable)).parent}\n" in (to / "pyvenv.cfg").read_text()
        ran = subprocess.run(
            [to / "bin" / "python", "-c", "import sys; print(sys.prefix)"], capture_output=True, text=True, check=True
        )  # fmt: skip
        assert ran.stdout.strip() == str(to)

    def test_a_copy_is_nobody_elses(self, tmp_path: Path) -> None:
        source, to = self.made(tmp_path / "theirs"), tmp_path / "release"
        (source / "pyvenv.cfg").chmod(0o600)
        (source / "lib").chmod(0o777)
        assert self.borrowed(source, to).returncode == 0
        self.as_it_should(to)
        for path in (to, *to.rglob("*")):
            if not path.is_symlink():
                assert path.stat().st_mode & 0o7022 == 0, path
                assert path.stat().st_mode & 0o044 == 0o044, path
                assert path.stat().st_uid == os.geteuid()
                if path.is_file():
                    assert path.stat().st_nlink == 1, path
        assert (source / "bin" / "program").read_text() == f"#!{source}/bin/python\n"

    def test_a_release_shares_its_files_with_the_next(self, tmp_path: Path) -> None:
        source, to = self.made(tmp_path / "first"), tmp_path / "second"
        kept = source / "lib" / "kept"
        kept.touch()
        assert self.borrowed(source, to, "--linked").returncode == 0
        self.as_it_should(to)
        assert (to / "lib" / "kept").stat().st_ino == kept.stat().st_ino
        assert "first" in (source / "bin" / "program").read_text()

    def test_what_cannot_be_linked_is_copied_whole(self, tmp_path: Path) -> None:
        shm = Path("/dev/shm")
        if not os.access(shm, os.W_OK) or shm.stat().st_dev == tmp_path.stat().st_dev:
            pytest.skip("needs a second file system")
        with tempfile.TemporaryDirectory(dir=shm) as other:
            source = self.made(Path(other) / "theirs")
            assert self.borrowed(source, tmp_path / "release", "--linked").returncode == 0
        self.as_it_should(tmp_path / "release")
        assert not (tmp_path / "release" / "theirs").exists()

    def test_what_is_no_environment_leaves_nothing(self, tmp_path: Path) -> None:
        assert self.borrowed(tmp_path, tmp_path / "release").returncode == 1
        assert not (tmp_path / "release").exists()


def test_any_command_can_be_run_as_the_services_run(tmp_path: Path) -> None:
    (tmp_path / "runuser").write_text('#!/bin/sh\nshift 3\nprintf "%s\\n" "$@"\n')
    (tmp_path / "runuser").chmod(0o755)
    environment = {"PATH": f"{tmp_path}:{os.environ['PATH']}"}
    done = subprocess.run(
        [DEPLOY / "drumstick-at", "stage", "keys", "show", "a b"], env=environment, capture_output=True, text=True,
        check=True, timeout=60,
    )  # fmt: skip
    said = done.stdout.splitlines()
    assert said[-4:] == ["/opt/drumstick/current/venv/bin/drumstick", "keys", "show", "a b"]
    assert {"DRUMSTICK_RIG=stage", "DRUMSTICK_RIG_FILE=/etc/drumstick/stage/rig.toml"} < set(said)


@pytest.mark.parametrize("words", [["params", "get"], ["panic"], ["rigs"], ["monitor"], ["preset", "list"]])
def test_the_rig_and_its_file_come_by_variables_too(words: list[str], tmp_path: Path) -> None:
    file = tmp_path / "rig.toml"
    file.write_text('nme = "x"\n')
    environment = {"DRUMSTICK_RIG": "stage", "DRUMSTICK_RIG_FILE": str(file)}
    done = CliRunner().invoke(app, words, env=environment)
    assert isinstance(done.exception, CommandError)
    assert "known here: name" in str(done.exception)


def test_a_command_that_knows_no_rig_does_not_mind(tmp_path: Path) -> None:
    done = CliRunner().invoke(
        app, ["scene", "check", "roll"], env={"DRUMSTICK_RIG": "a/b", "DRUMSTICK_RIG_FILE": "x"}
    )
    assert done.exit_code == 0, done.output


def _imported(tree: ast.AST) -> set[str]:
    # Top-level names, wherever in the file they are imported.
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            names.add(node.module.partition(".")[0])
    return names


def test_what_is_installed_on_a_stage_is_all_that_the_program_imports() -> None:
    locked = {
        re.sub(r"[-_.]+", "-", name).lower()
        for name in re.findall(
            r"^([A-Za-z0-9._-]+)==", (ROOT / "requirements.lock").read_text(), re.MULTILINE
        )
    }
    given_by = packages_distributions()
    lacking: dict[str, set[str]] = {}
    for folder in ("services", "shared"):
        own = {path.name for each in ("services", "shared") for path in (ROOT / each).iterdir()}
        for path in (ROOT / folder).rglob("*.py"):
            for name in (
                _imported(ast.parse(path.read_text(encoding="utf-8"))) - own - sys.stdlib_module_names
            ):
                brought = {re.sub(r"[-_.]+", "-", each).lower() for each in given_by.get(name, [name])}
                if not brought & locked:
                    lacking.setdefault(name, set()).add(str(path.relative_to(ROOT)))
    assert lacking == {}


def test_the_wheel_has_seven_names_of_ours_at_its_top() -> None:
    """docs/decisions/0034-top-level-names.md."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    packages = project["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]
    services = {"haptic_server", "sound_server", "web_panel", "rig"}
    assert {Path(each).name for each in packages} == services | {"drumstick", "protocol", "realtime"}


# `dpkg -c drumstick-tools_2.7.2-1_amd64.deb | grep bin/`, of the project Drumstick, about MIDI.
DEBIANS = {
    f"drumstick-{name}"
    for name in (
        "drumgrid", "dumpmid", "dumprmi", "dumpsmf", "dumpwrk",
        "guiplayer", "metronome", "playsmf", "sysinfo", "vpiano",
    )
}  # fmt: skip


def test_our_programs_shadow_none_of_debians_package_drumstick_tools() -> None:
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["scripts"]
    laboratory = tomllib.loads((ROOT / "lab" / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert set(scripts) == {"drumstick", "haptic-drumstick"}
    assert "scripts" not in laboratory
    deployed = re.findall(r"/usr/local/s?bin/([\w-]+)", (DEPLOY / "staged.sh").read_text(encoding="utf-8"))
    assert set(deployed) >= {"drumstick", "drumstick-at"}
    assert not DEBIANS & {*scripts, *deployed}


def test_one_version_is_written_everywhere() -> None:
    written = {
        tomllib.loads((ROOT / path).read_text(encoding="utf-8"))["project"]["version"]
        for path in ("pyproject.toml", "lab/pyproject.toml")
    }
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))["version"]
    headings = re.findall(r"^## \[(.*)\]", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert headings[0] == "Unreleased"
    assert {cited, *headings[1:2]} <= written == {cited}


def test_what_an_index_shows_of_the_package_stands_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No link or picture that is relative, no extra that is not there, and its Python runs."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    page = (ROOT / project["readme"]).read_text(encoding="utf-8")
    links = re.findall(r"(?:\]\(|\]: |src=[\"']|href=[\"'])([^)\"'\s]+)", page)
    assert links
    assert [link for link in links if not link.startswith("https://")] == []
    extras = {*re.findall(r"(?:`|haptic-drumstick)\[(\w+)\]", page)}
    assert extras == {*project["optional-dependencies"]}
    (code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(compile(code, project["readme"], "exec"), {})
    assert (tmp_path / "roll.wav").stat().st_size > 100_000
