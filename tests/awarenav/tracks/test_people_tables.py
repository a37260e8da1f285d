"""Tables of people as others write them: `tracks` and `scenario from-recording` read the same."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from awarenav.cli import main
from awarenav.errors import AwarenavError
from awarenav.tracks import read_people_table
from awarenav.tracks._calibration import FollowedPerson, calibrate
from awarenav.tracks._smoothing import SmoothedPath
from awarenav.tracks._units import refuse_other_units
from sim_tests.scenario.recordings import read_table
from tracking import TrackingError

Number = Callable[[float], float]


def same(value: float) -> float:
    return value


def table(
    *, time: Number = same, place: Number = same, ids: tuple[str, ...] = ("1", "2"), rows: int = 60
) -> str:
    """Return two people who walk past each other at 1.2 m/s, at 10 Hz."""
    lines = ["t_s,id,x_m,y_m"]
    for row in range(rows):
        for id, way in zip(ids, (1.0, -1.0), strict=True):
            x_m = way * (0.12 * row - 4.0)
            lines.append(f"{time(0.1 * row)!r},{id},{place(x_m)!r},{place(2.0 * way)!r}")
    return "\n".join(lines) + "\n"


def both(path: Path) -> tuple[int, int]:
    """Return the exit status of `scenario from-recording` and of `tracks`, which prints last."""
    made = main(["scenario", "from-recording", str(path), "--out", str(path.with_suffix(".yaml"))])
    return made, main(["tracks", str(path), "--ids", "--json", "--out", "none"])


def tracks_of(out: str) -> list[dict[str, object]]:
    """Return the tracks that `tracks --json` has printed last."""
    found: list[dict[str, object]] = json.loads(out[out.index("\n[\n") :])
    return found


@pytest.mark.parametrize(
    "change",
    [
        lambda text: "\ufeff" + text,
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace(",", ", "),
        lambda text: text.replace(",", " ,  "),
        lambda text: "\ufeff" + text.replace(",1,", ", 1.0,").replace(",2,", ", 2.0,"),
        lambda text: text.replace("y_m\n", "y_m,note\n").replace("\n0", ",\n0"),
        lambda text: text.replace("t_s,id", "t_s,ID").replace("ID", '"id"') + "\n\n",
    ],
)
def test_both_commands_read_a_table_as_others_write_it(change, tmp_path: Path, capsys) -> None:
    (tmp_path / "plain.csv").write_text(table())
    (tmp_path / "other.csv").write_text(change(table()), encoding="utf-8")
    assert both(tmp_path / "plain.csv") == (0, 0)
    plain = tracks_of(capsys.readouterr().out)
    assert [track["id"] for track in plain] == [1, 2]
    assert both(tmp_path / "other.csv") == (0, 0)
    assert tracks_of(capsys.readouterr().out) == plain
    people = [(tmp_path / f"{name}_people.csv").read_text() for name in ("plain", "other")]
    assert people[0] == people[1]


@pytest.mark.parametrize(
    ("suffix", "mark", "first"), [(".tsv", "\t", ""), (".csv", ",", "sep=,\n"), (".TSV", "\t", "")]
)
def test_tabs_and_the_first_line_of_a_spreadsheet_are_read(suffix, mark, first, tmp_path) -> None:
    plain, other = tmp_path / "plain.csv", tmp_path / f"other{suffix}"
    plain.write_text(table())
    other.write_text(first + table().replace(",", mark))
    rows = [read_people_table(path).rows for path in (plain, other)]
    assert [row._replace(line=0) for row in rows[0]] == [row._replace(line=0) for row in rows[1]]
    assert both(other) == (0, 0)


def test_ids_may_be_any_text_and_tracks_numbers_them(tmp_path: Path, capsys) -> None:
    path = tmp_path / "names.csv"
    path.write_text(table(ids=("7", "bén, 2nd")).replace("bén, 2nd", '"bén, 2nd"'), "utf-8")
    assert both(path) == (0, 0)
    out, err = capsys.readouterr()
    assert "ids that are no whole numbers are numbered: 8 is 'bén, 2nd'" in err
    assert [each["id"] for each in tracks_of(out)] == [7, 8]
    assert {each.id for each in read_table(path).tracks} == {"7", "bén, 2nd"}
    words = ["scenario", "from-recording", str(path), "--out", str(tmp_path / "a.yaml")]
    assert main([*words, "--robot-id", "7.0", "--start", "0", "-6", "--goal", "5", "-6"]) == 0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (table(place=lambda m: 1000.0 * m), "1200 m/s.*look like millimetres"),
        (table(place=lambda m: 100.0 * m), "at 120 m/s.*look like centimetres"),
        (table(time=lambda s: 10.0 * 25.0 * s), "look like numbers of frames"),
        (table(time=lambda s: 780.0 + round(60.0 * s)), "0.02 m/s.*look like numbers of frames"),
        (table(time=lambda s: round(1000.0 * s)), "0.0012 m/s.*look like milliseconds"),
        (table(time=lambda s: round(1e6 * s)), "look like microseconds"),
        (table(time=lambda s: round(1e9 * (1.7e9 + s))), "look like nanoseconds"),
        (table(time=lambda s: s / 12.5), "at 15 m/s, and nobody does at more than 12 m/s"),
    ],
)
def test_both_commands_and_calibrate_refuse_other_units(text, message, tmp_path, capsys) -> None:
    path = tmp_path / "people.csv"
    path.write_text(text)
    with pytest.raises(AwarenavError, match=message) as raised:
        read_people_table(path)
    assert both(path) == (2, 2)
    assert capsys.readouterr().err.count(str(raised.value)) == 2
    assert main(["tracks", "calibrate", str(path), "--out", str(tmp_path / "p.yaml")]) == 2
    assert str(raised.value) in capsys.readouterr().err
    assert not (tmp_path / "p.yaml").exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (table() + "9,1,1_0,2\n", "line 122: x_m must be a finite number, got '1_0'"),
        (table().replace("y_m", "x_m", 1), "the header misses y_m"),
        (table().replace("y_m\n", "y_m,x_m\n"), "the header has twice x_m"),
        (table().replace(",", ";"), "columns are separated by commas, these by ';'"),
        (table().replace(",", "\t"), r"columns are separated by commas, these by '\\t'"),
        (
            table().replace(".", ","),
            "line 2: more values than the header's 4; numbers have a decimal point",
        ),
        (table().encode("utf-16"), "must be UTF-8"),
        ("t_s,id,x_m,y_m\n", "holds no rows"),
        ("t_s,id,x_m,y_m\n0,1,2,far\n", "line 2: y_m must be a finite number, got 'far'"),
        ("t_s,id,x_m,y_m\n0,1,2,3\n0,,2,3\n", "line 3: id is empty"),
        ("t_s,id,x_m,y_m\n0,1,2\n", "line 2: y_m must be a finite number, got None"),
        ("", "it must name t_s, id, x_m, y_m"),
    ],
)
def test_both_commands_refuse_the_same_tables(text, message, tmp_path: Path, capsys) -> None:
    path = tmp_path / "people.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    assert both(path) == (2, 2)
    err = capsys.readouterr().err
    assert err.count(message.replace("\\\\", "\\")) == 2


def test_people_who_stand_or_rest_are_no_error_of_units() -> None:
    """Somebody at a bench for minutes, steps that are jumps of noise, a jogger, a slow walker."""
    rng = np.random.default_rng(0)
    times = np.arange(0.0, 200.0, 0.1)
    bench = np.cumsum(np.clip(times - 190.0, 0.0, None) > 0.0)[:, None] * [0.12, 0.0]
    noise = rng.normal(0.0, 0.3, (len(times), 2))
    slow = times[:, None] * [0.4, 0.0]
    jogger = times[:, None] * [2.8, 0.0]
    for places in (bench, bench + 0.02 * noise, noise, slow, slow + noise, jogger):
        refuse_other_units("recording", [(times, places)])


def test_people_who_cross_a_narrow_view_are_judged_together() -> None:
    """Each walks less than two metres; nobody stands."""
    seconds = np.arange(0.0, 1.4, 0.1)
    places = seconds[:, None] * [1.3, 0.0]
    refuse_other_units("recording", [(seconds, places)] * 40)
    with pytest.raises(TrackingError, match=r"0\.13 m/s.*look like numbers of frames"):
        refuse_other_units("recording", [(10.0 * seconds, places)] * 40)
    # A few people who shift slowly are no sample.
    refuse_other_units("recording", [(10.0 * seconds, places)] * 9)


@pytest.mark.parametrize("speed_mps", [0.1, 15.0])
def test_a_calibration_from_python_refuses_them_as_well(speed_mps: float) -> None:
    """Such as frames at 12 Hz whose numbers are taken for seconds."""
    times = np.arange(0.0, 80.0, 0.1)
    people = []
    for angle in np.linspace(0.0, 6.0, 8):
        velocity = speed_mps * np.array([math.cos(angle), math.sin(angle)])
        states = np.hstack([times[:, None] * velocity, np.tile(velocity, (len(times), 1))])
        covariances = np.tile(0.01 * np.eye(4), (len(times), 1, 1))
        reference = SmoothedPath(times, states, covariances)
        people.append(FollowedPerson(times, states, covariances, reference))
    with pytest.raises(TrackingError, match=r"^the recordings: people .* in seconds, places in me"):
        calibrate(people)


def test_calibrate_refuses_numbers_of_frames_in_json_lines(tmp_path: Path, capsys) -> None:
    lines = []
    for frame in range(100):
        people = [
            {
                "position_camera_m": [0.05 * frame - 4.0 + lane, 1.5, 4.0 + 3.0 * lane],
                "position_covariance_m2": (0.01 * np.eye(3)).tolist(),
                "score": 0.9,
            }
            for lane in range(6)
        ]
        record = {"frame": f"{frame}.png", "stamp_s": float(frame), "T_odom_camera": None}
        lines.append(json.dumps({**record, "people": people}))
    path = tmp_path / "estimates.jsonl"
    path.write_text("\n".join(lines) + "\n")
    out = tmp_path / "p.yaml"
    assert main(["tracks", "calibrate", str(path), "--out", str(out)]) == 2
    assert f"{path}: people walk at 0.05" in (err := capsys.readouterr().err)
    assert "numbers of frames" in err
    assert not out.exists()
