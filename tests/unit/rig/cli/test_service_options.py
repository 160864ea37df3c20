"""Options of a rig's parts: all that a terminal takes, a service takes too."""

import inspect

import pytest

from rig.cli import play, service

# Of one evening in a terminal; recording is a command of its own there, and systemd knows of no scenes.
_TERMINAL_ONLY = {"set_list", "duration", "as_json", "record", "record_force"}


def _options(*commands: object) -> dict[str, object]:
    return {
        name: each.default
        for command in commands
        for name, each in inspect.signature(command).parameters.items()  # type: ignore[arg-type]
    }


@pytest.mark.parametrize(
    ("whole", "parts"),
    [
        (play.haptic_command, (service.servo_command, service.gateway_command)),
        (play.sound_command, (service.sound_command,)),
        (play.panel_command, (service.panel_command,)),
    ],
)
def test_a_service_takes_every_option_of_its_part(whole: object, parts: tuple[object, ...]) -> None:
    wanted = {name: default for name, default in _options(whole).items() if name not in _TERMINAL_ONLY}
    assert _options(*parts) == wanted
