"""`[strike]`: which curves are read, and what is said about those that are none."""

import pytest

from drumstick.scenes.scene_text import SceneError, as_tables, from_tables, parse

MALLET = '[drum]\nexcitation = "mallet"\n'
TABLE = 'curve = "table"\ntable = [[0.1, 0.05], [0.6, 0.4], [1.5, 0.9]]\n'


@pytest.mark.parametrize(
    "text",
    [
        "",
        'curve = "log"\nsoftest_m_per_s = 0.02\nfull_scale_m_per_s = 1.5\n',
        TABLE,
        TABLE + "full_scale_m_per_s = 1.5\n",
        "stroke_m_per_s = 8.0\nsoft_stroke_m_per_s = 1.0\n",
    ],
)
def test_a_scene_comes_back_from_its_tables(text: str) -> None:
    scene = parse(f"{MALLET}[strike]\n{text}", "mine")
    assert from_tables(as_tables(scene)) == scene


def test_the_last_speed_of_a_table_is_full_scale() -> None:
    assert parse(f"[strike]\n{TABLE}", "mine").strike.full_scale_m_per_s == 1.5


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ('curve = "dB"', 2, "strike.curve: 'dB' is not one of 'linear', 'log', 'table'"),
        (
            'curve = "log"\nsoftest_m_per_s = 2.0',
            3,
            "strike.softest_m_per_s: 2 m/s must be below full_scale_m_per_s, 2 m/s",
        ),
        (
            "softest_m_per_s = 0.1",
            2,
            'strike.softest_m_per_s: is for curve = "log": set it, or leave this out',
        ),
        ('curve = "log"\nsoftest_m_per_s = 0.0', 3, "0.0 m/s is outside 0.001 .. 10 m/s"),
        (
            'curve = "table"',
            1,
            'strike.table: curve = "table" needs 2 to 16 points, each [m/s, level]; it has 0',
        ),
        ('curve = "table"\ntable = [[1.0, 0.5]]', 3, "it has 1"),
        ("table = [[0.1, 0.1], [1.0, 1.0]]", 2, 'strike.table: is for curve = "table"'),
        ('curve = "table"\ntable = [[0.1, 0.1], [1.0, 1.5]]', 3, "point 2 has the level 1.5, outside 0 .. 1"),
        (
            'curve = "table"\ntable = [[0.5, 0.1], [0.5, 0.5]]',
            3,
            "point 2 has 0.5 m/s after 0.5 m/s: let the speeds rise",
        ),
        (
            'curve = "table"\ntable = [[0.5, 0.6], [0.7, 0.5]]',
            3,
            "point 2 has the level 0.5 after 0.6: let no level fall",
        ),
        (
            'curve = "table"\ntable = [[0.5, 0.6], [25.0, 0.7]]',
            3,
            "25.0 m/s; level 0 .. 1 is outside 0 .. 20 m/s; level 0 .. 1",
        ),
        (TABLE + "full_scale_m_per_s = 2.0", 4, "2 m/s is not the last speed of strike.table, 1.5 m/s"),
        ("stroke_m_per_s = 8.0", 2, 'is a mallet\'s: set [drum] excitation = "mallet", or leave this out'),
        ("soft_stroke_m_per_s = 1.0", 2, "1 m/s must be below stroke_m_per_s, 0 m/s"),
        ("stroke_m_per_s = 2.0\nsoft_stroke_m_per_s = 3.0", 3, "3 m/s must be below stroke_m_per_s, 2 m/s"),
    ],
)
def test_a_curve_that_is_none_is_refused(text: str, line: int, words: str) -> None:
    with pytest.raises(SceneError) as refused:
        parse(f"[strike]\n{text}\n", "mine.toml")
    found = [mistake for mistake in refused.value.mistakes if words in mistake]
    assert found, refused.value.mistakes
    assert found[0].startswith(f"mine.toml:{line}: ")


def test_a_table_of_too_many_points_is_refused() -> None:
    points = ", ".join(f"[{0.1 * k:.1f}, {0.05 * k:.2f}]" for k in range(17))
    with pytest.raises(SceneError, match="must be a list of 0 to 16 rows of 2 numbers"):
        parse(f'[strike]\ncurve = "table"\ntable = [{points}]\n', "mine")
