"""Writes docs/scenes.md from the declarations and the shipped scenes: drumstick lab scenes-page."""

import inspect
import sys
from collections.abc import Iterator
from dataclasses import MISSING, fields

from drumstick.drum.effects.registry import DRUM_TABLES, FORMER_NAMES
from drumstick.parameters.declare import Quantity, quantities
from drumstick.parameters.drum import Drum
from drumstick.parameters.mallet import MATERIALS, Mallet
from drumstick.parameters.rig import Hand, Human
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Geometry, Stick
from drumstick.scenes.scene_text import TABLES, parse, shipped_names, shipped_text
from drumstick.scenes.stick_tables import Z_H0
from drumstick.scenes.table import table_of
from drumstick.stick.effects.registry import STICK_TABLES
from drumstick_lab.checkout import DOCS
from drumstick_lab.measuring.stored import read

PAGE = DOCS / "scenes.md"

OTHERS = {name: table for name, table in TABLES.items() if name != "stick"}


def _materials() -> list[str]:
    keys = list(quantities(Mallet))[1:]
    lines = [f"| material | {' | '.join(f'`{key}`' for key in keys)} |", f"|---{'|---' * len(keys)}|"]
    for name, numbers in MATERIALS.items():
        lines.append(f"| `{name}` | {' | '.join(f'{numbers[key]:g}' for key in keys)} |")
    return lines


# What the keys of a table do not say by themselves.
_MORE = {
    "modal": [
        "Without this table a mesh is computed; with it, a bank of modes instead. A bank needs no tuning. It takes the effects `air`, `kettle`,",
        "`uniform_loss`, `internal_loss`, `muffle`, `tension` and `rim`, mallets and microphones; `cavity`, `snare` and `sympathy` need the mesh, `kettle` the bank. The bank's cost",
        "rises with the square of `top_Hz`: see `drumstick scene cost`, which lets the drum ring. Under `tension`, and while a mallet plays, a mode costs about",
        "four times as much: [share of a core](measured.md#share-of-a-core) has what each scene takes when it is played. Microphones, however many, take about a third",
        "more time than pickups. At most",
        "60,000 modes are computed (a drum of 100 Hz up to 20 kHz has 57,740, which take some seconds to load), with `tension` or a mallet 20,000.",
        "",
    ],
    "mallet": [
        'Only with `[drum] excitation = "mallet"`, on a mesh or a bank of modes. Each strike throws a virtual mallet at the moving',
        "head, and the head throws it back. Soft mallets and soft strokes stay on the head longer, and the two may meet more than once. So a hard stroke is",
        "brighter than a soft one, and no two strokes of a roll are the same. The force on the hand still comes from `[stick]`, not from the mallet.",
        "Values given here replace those of the material:",
        "",
        *_materials(),
        "",
        "p = 1.5 and K of wood, nylon and cork are Hertz's for such bodies on polyester, felt's p is a piano hammer's (Chaigne and",
        "Askenfelt 1994); the other numbers are estimates, wood's mass chosen for 3 to 6 ms on a 13-inch tom. `exponent` costs least where it is a",
        "multiple of one half. On a mesh the tip covers at least the junctions within one spacing, at most those within seven; on modes it",
        "is as wide as it is.",
        "",
    ],
    "strike": [
        "The level (0 .. 1) goes out with each strike: OSC `level`, MIDI velocity, Zenoh. `linear`: speed over full scale. `log`:",
        "ln(speed/softest)/ln(full scale/softest), so equal steps of level are equal steps in decibels, and soft playing is spread",
        "out. `table`: straight between 2 to 16 points, flat outside them; speeds rise, no level falls:",
        "",
        "```toml",
        "[strike]",
        'curve = "table"',
        "table = [[0.1, 0.05], [0.6, 0.4], [1.5, 1.0]]    # m/s, level",
        "```",
        "",
        "A haptic stick moves at 0.2 to 2 m/s, a drummer's at 1 to 13. So that a mallet",
        '(`[drum] excitation = "mallet"`) can play its whole dynamic range, its speed is soft + level (hard - soft), with',
        "`soft_stroke_m_per_s` and `stroke_m_per_s`. A drum without a mallet plays the force of the contact itself, whatever the level.",
        "",
    ],
    "hand": [
        "A recorded gesture (`drumstick up --scene accents` plays one) is where the hand holds its spring: rows of `t_s` or `t_ns`, and",
        "`z_m` from the head, uneven in time if you like, straight between rows, again and again; where the file ends elsewhere than it",
        "began, the hand goes back first. It stays within `[guard]` `lowest_m` .. `highest_m` and half of `max_speed_m_per_s` (a mass on a",
        "spring goes up to twice as fast as the spring's end). For one of your own, write `drumstick scene show accents` into a file and",
        "your CSV beside it; `drumstick scene check FILE` names every mistake in both.",
        "",
        "It also says how firmly the hand grips, in columns `k_hand_N_per_m` and `r_out_N_s_per_m`, with `z_m` or instead of it (scene `grip`,",
        "[what it does](stick.md)). What has no column stays as in `[stick]`, which must be the firmest grip of all: no row has a larger",
        "K_hand, or a smaller R_out, and R_out stays below R_in. So the envelope has judged every row. A person changes a grip within some",
        "100 ms; where the file ends with another grip than it began, the hand takes that long to go back.",
        "",
        '- On the exact stick (`[device] plant = "stick"`) the gesture begins at the throw, offline (`simulate`, `analyse`, `render`) as live.',
        "  `z_m` moves z_ss there, not below that of `[stick]`; such a hand lifts a dead stick itself, and nobody throws it again. `analyse` tells",
        "  the grip of `[stick]` held still, and for each grip of the file the roll that it would settle in.",
        "- On a simulated arm it moves the hand that holds the arm. Offline, `ds.servo` plays that.",
        "- What is set live moves the whole gesture: K_hand in proportion, R_out and z_ss by as much. What is shown as `k_hand` is the firmest",
        "  grip of the file then, and the predicted roll is that one's. Where a grip would turn the stick's height into more speed than the",
        "  envelope allows, it waits until it does not.",
        "",
    ],
}

# What the keys of an effect do not say by themselves.
_MORE_OF_EFFECT = {
    "tension": [
        "f² rises with the square of the head's slope. Against the speed of the strike the exponent is less than 2, because a stiffer head gives way less, and cents",
        "grow ever more slowly, being a logarithm, until `most_cents` ends them ([decision 0036](decisions/0036-tension.md)).",
        "",
    ],
    "snare": [
        "Wires want a mesh of 24 kHz or more (`[mesh] rate_Hz`). From 12 to 24 kHz the octaves from 0.5 to 10 kHz change by {0:.2g} dB, from 24 to 48 kHz by {1:.2g} dB, as means over",
        "strokes; a single stroke is another one on each mesh ([measured](measured.md#effects-on-finer-meshes)).",
        "",
    ],
}


def _more_of(effect: str) -> list[str]:
    rows = read("refinement")["rows"]
    changes = next(row["changes"] for row in rows if row["effect"] == "snare" and row["unit"])
    return [line.format(*changes) for line in _MORE_OF_EFFECT.get(effect, [])]


_HUMAN = [
    "A simulated hand plays each strike like the one before. With this table its roll is as uneven as a person's: `interval_percent` and `level_dB` are standard",
    "deviations of what is heard, over many strikes. Both must be given, for a player's evenness depends on tempo and skill: drummers are at 3 to 10 % and 1 to 3 dB,",
    "more the faster they play ([measured](stick.md#a-hand-that-is-no-machine)). Why it is made like this: [decision 0059](decisions/0059-human-hand.md).",
    "",
    "```toml",
    "[hand.human]",
    "interval_percent = 3.0",
    "level_dB = 1.0",
    "```",
    "",
    "- What varies is the pulse's strength, and how firmly the hand presses from one release to the next. So every strike is still one of the exact stick, and its",
    "  contact, force and sound belong together. A strike harder than usual gets a firmer hand: the player keeps time.",
    "- The hand finds out by the roll itself how large its errors must be. Within 6 % for the shipped rolls at up to 5 % and 1 dB, and 10 % up to the limits. Mean rate",
    "  and level stay those of the even roll within 3 % and 0.3 dB. A strike's level is correlated with the one before, as the roll remembers it (0.7 in `roll`).",
    "- The same seed plays the same performance, in `simulate`, in `render` and live. An even roll is what all measurements here are made of: no shipped scene has this table.",
    "- The hand's errors are those of the scene's own values. What is set live changes the spread: at half the pulse of `roll` 3 % and 1 dB become 4.2 % and 1.0 dB,",
    "  at twice the pulse 2.1 % and 1.1 dB.",
    '- It needs `[effects.pulse]`, `gesture = "hold"` and `[device] plant = "stick"`, no effect whose motion never repeats, and a roll that repeats strike by strike.',
    "  `drumstick scene check` says which spread this roll cannot have, and the nearest that it can. In the hand of a person (`--device pointer`, an arm) nothing is added.",
    "- The envelope judges the strongest strikes that it can come to: a pulse up by three standard deviations, a hand that presses twice as firmly. A scene or a set",
    "  that is safe even may be refused uneven. `analyse`, rate, level and predictions are about the even roll.",
    "",
]


def _range(quantity: Quantity) -> str:
    if quantity.choices:
        return ", ".join(
            f"`{choice}`" if isinstance(choice, str) else str(choice) for choice in quantity.choices
        )
    if quantity.kind is str:
        return f"text, at most {quantity.high:g} characters"
    unit = "" if quantity.unit in ("1", "number") else f" {quantity.unit}"
    return f"{quantity.low:g} .. {quantity.high:g}{unit}"


def _default(value: object) -> str:
    if value is MISSING:
        return "must be given"
    if value == "":
        return "none"
    return f"{value:g}" if isinstance(value, float) else f"`{value}`"


def _keys(table: type) -> Iterator[str]:
    yield "| key | range | default | live as | what it is |"
    yield "|---|---|---|---|---|"
    defaults = {field.name: field.default for field in fields(table)}
    for name, quantity in quantities(table).items():
        live = f"`{quantity.wire}`" if quantity.wire else ""
        words = quantity.words + (f", {quantity.equation}" if quantity.equation else "")
        yield f"| `{name}` | {_range(quantity)} | {_default(defaults[name])} | {live} | {words} |"
    yield ""


def _about(table: type) -> str:
    # The first line of the module's docstring: what the effect is. It stands beside the physics, and only there.
    text = inspect.getdoc(sys.modules[table.__module__])
    assert text is not None
    return text.partition("\n")[0]


def _scenes() -> Iterator[str]:
    yield "| scene | effects | can be set live | |"
    yield "|---|---|---|---|"
    for name in shipped_names():
        scene: Scene = parse(shipped_text(name), name)
        effects = ", ".join([*scene.effects, *(f"drum: {name}" for name in scene.drum.effects)]) or "none"
        live = ", ".join(f"`{name}`" for name in table_of(scene))
        yield f"| `{name}` | {effects} | {live} | {scene.words} |"
    yield ""


def page() -> str:
    """The whole page."""
    lines = [
        "# Scenes",
        "",
        "Made by `drumstick lab scenes-page` from the declarations in `shared/drumstick`; do not edit.",
        "",
        "Words: [glossary](glossary.md).",
        "",
        "A scene is one TOML file. An effect whose table the scene does not have is not computed, and has no slider. `[modal]` likewise:",
        "without it the drum is a mesh. Every other table, and every key, that is left out has the default below.",
        "`drumstick scene check FILE` names every mistake with file, line, key, value, limit and unit; `drumstick scene show NAME > mine.toml`",
        "is a start; `drumstick scene cost NAME` tells what it costs on this machine.",
        "",
        "*Live as* is the name by which the value can be set while the rig plays (`drumstick params set NAME=...`, OSC",
        "`/drumstick/param/NAME`, the page). Where it is empty, the value is read at the start only.",
        "",
        "## Shipped",
        "",
        *_scenes(),
        "## `[stick]`",
        "",
        "Above the head (1): m z'' + R_out z' + K_hand (z - z_ss) = f. In contact (2): m z'' + R_in z' + K_hand (z - z_ss) + K_coll z = f.",
        "z: height of the tip above the head; f: force of the effects; the symbols are explained in [stick.md](stick.md).",
        "",
        *_keys(Stick),
        f"`z_h0_m` ({_range(Z_H0)}) may stand instead of `z_ss_m`: {Z_H0.words.lower()}, {Z_H0.equation}.",
        "",
        "### `[stick.geometry]`",
        "",
        "Instead of `m_kg` and `g_star_m_per_s2`: a rigid stick that turns about the hand. Positions along it count from any one end. With",
        "L = tip - grip and I = inertia + mass (com - grip)², m = I/L² and m g* = mass g (com - grip)/L.",
        "",
        *_keys(Geometry),
        "## Effects of the stick",
        "",
        "Summed in this order. Every one is linear between its events, so the method `exact` covers them all, alone and together; the",
        "steppers (`drumstick simulate --method`) do too.",
        "",
    ]
    for name, table in STICK_TABLES.items():
        lines += [f"### `[effects.{name}]`", "", _about(table), "", *_keys(table)]
    lines += ["## The rest", ""]
    for name, table in OTHERS.items():
        lines += [f"### `[{name}]`", "", *_keys(table), *_MORE.get(name, [])]
        if table is Hand:
            lines += ["#### `[hand.human]`", "", *_HUMAN, *_keys(Human)]
        if table is Drum:
            former = {name: old for old, name in FORMER_NAMES.items()}
            for effect, kind in DRUM_TABLES.items():
                about = str(inspect.getdoc(kind))
                if effect in former:
                    about += f" Its former name, `{former[effect]}`, is still read, with a note."
                lines += [f"#### `[drum.effects.{effect}]`", "", about, "", *_keys(kind), *_more_of(effect)]
    return "\n".join(lines).rstrip() + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
