"""Keys that stand twice, numbers as ROS writes them, and what is written and read again."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from awarenav.errors import AwarenavError
from awarenav.records import read_records
from nav_adapter import AwarenessPolicy, NavError
from nav_adapter.ros2 import RobotFile
from perception import Camera, PerceptionError
from perception.documents import parse_json, parse_yaml, read_json, yaml_text
from perception.laser import MapCells
from sim_tests import SimError
from sim_tests.scenario import Scenario
from tracking import TrackerConfig, TrackingError

SCALARS = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text("-.0eE1")
VALUES = st.recursive(SCALARS, lambda each: st.lists(each) | st.dictionaries(st.text("e1"), each))


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("a: 1\nb: 2\na: 1\n", "has the key 'a' twice, in lines 1 and 3"),
        ("x:\n- y: {k: 1,\n   k: 2}\n", "has the key 'k' twice, in lines 2 and 3"),
        ("on: 1\n'on': 2\nyes: 3\n", "has the key True twice, in lines 1 and 3"),
        ("b: &b {k: 1}\nc: &c {k: 2}\n<<: *b\n<<: *c\n", "has the key '<<' twice, in lines 3 and"),
        ("b: &b {k: 1}\nc: {<<: {m: 1, m: 2}}\n", "has the key 'm' twice, in lines 2 and 2"),
    ],
)
def test_a_key_that_stands_twice_in_yaml_is_refused_with_both_lines(text: str, what: str) -> None:
    with pytest.raises(PerceptionError, match=f"^text {what}"):
        parse_yaml(text, "text")


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("a:\n\tb: 1\n", "line 2, column 1: .*; indent with spaces, not with a tab"),
        ("a: {\n\tb: [1\n", "is not valid YAML: line 3, column 1: "),
        ("", "must hold lines of `key: value`, got nothing"),
        ("- a\n", "must hold lines of `key: value`, got a list"),
        ("words\n", "must hold lines of `key: value`, got a single value"),
    ],
)
@pytest.mark.parametrize(
    ("read", "error"),
    [(TrackerConfig.from_yaml, TrackingError), (Scenario.from_yaml, SimError)],
)
def test_a_file_without_keys_is_refused_in_plain_words(
    read: Callable[[Path], object], error: type[Exception], text: str, what: str, tmp_path: Path
) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(error, match=what):
        read(path)


def test_merge_keys_keep_their_meaning() -> None:
    """A mapping's own key replaces a merged one, and an earlier merged mapping a later one."""
    text = "a: &a {k: 1, l: 2}\nb: &b {<<: *a, k: 3}\nc: {<<: [*b, *a], l: 5}\nd: [*b, *b]\n"
    b = {"k": 3, "l": 2}
    assert parse_yaml(text, "text") == {
        "a": {"k": 1, "l": 2},
        "b": b,
        "c": {"k": 3, "l": 5},
        "d": [b, b],
    }


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ('{"a": 1, "b": 2,\n\n"a": 3}', "a"),
        ('{"x": [{"a": ": {\\"",\n"\\u0061": 2}]}', "a"),
        (b'{"a": {"k": 1, "k": 1}}', "k"),
    ],
)
def test_a_key_that_stands_twice_in_json_is_refused(text: str | bytes, key: str) -> None:
    with pytest.raises(PerceptionError, match=f"^text has the key '{key}' twice$"):
        parse_json(text, "text", finite=True)

    # The same key of two objects is no repetition.
    text = '[{"a": {"a": 1}}, {"a": [{"a": 2}]}]'
    assert parse_json(text, "t") == parse_yaml(text, "t") == [{"a": {"a": 1}}, {"a": [{"a": 2}]}]


@pytest.mark.parametrize(
    ("read", "error", "text"),
    [
        (RobotFile.from_yaml, NavError, "max_speed_mps: 1.0\nmax_speed_mps: 9.9\n"),
        (AwarenessPolicy.from_yaml, NavError, "speed: {}\nspeed: {}\n"),
        (
            TrackerConfig.from_yaml,
            TrackingError,
            "awareness: {missed_frame_s: 1,\n missed_frame_s: 2}\n",
        ),
        (Scenario.from_yaml, SimError, "name: a\nname: b\n"),
        (Camera.from_yaml, PerceptionError, "image_width: 640\nimage_width: 320\n"),
        (MapCells.from_yaml, PerceptionError, "resolution: 0.05\nresolution: 0.5\n"),
        (read_json, PerceptionError, '{"a": 1,\n"a": 2}'),
        (read_records, AwarenavError, '{"frame": "a", "frame": "b"}\n'),
    ],
)
def test_every_reader_refuses_a_key_that_stands_twice(read, error, text, tmp_path: Path) -> None:
    path = tmp_path / "file.yaml"
    path.write_text(text)
    with pytest.raises(error, match=r"file\.yaml.* has the key '\w+' twice"):
        read(path)


def test_numbers_with_an_exponent_are_numbers(tmp_path: Path) -> None:
    text = "[5e-2, 1E5, -1e1, +.5e3, 5.e1, 1.0e-3, '5e-2', 5e, e5, 1e2x]"
    read = parse_yaml(text, "text")
    assert read == [0.05, 1e5, -10.0, 500.0, 50.0, 1e-3, "5e-2", "5e", "e5", "1e2x"]
    (tmp_path / "tracker.yaml").write_text("awareness: {missed_frame_s: 1e-2}\n")
    config = TrackerConfig.from_yaml(tmp_path / "tracker.yaml")
    assert config.awareness.missed_frame_s == 0.01


@settings(max_examples=25, deadline=None)
@given(VALUES)
def test_what_is_written_as_yaml_is_read_again_as_it_was(value: object) -> None:
    """Also texts that look like numbers, such as a scenario that is called 1e5."""
    assert parse_yaml(yaml_text(value), "text") == value
