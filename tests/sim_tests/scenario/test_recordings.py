"""Recordings of people become scenarios: the table, resampling, the task, and crossings."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from paths import SHARED

from awarenav.cli import main
from sim_tests import CrossingResult, Scenario, SimError, run_crossing
from sim_tests.actors.behaviour import read_recordings
from sim_tests.scenario.catalogue import drawn_problems
from sim_tests.scenario.recordings import RecordingOptions, read_table, scenario_from_recording
from sim_tests.study.report._write import recorded_people
from sim_tests.study.runs import plan_jobs

CLIPS = sorted((SHARED / "data").glob("citr_*.csv"))
Place = Callable[[float], tuple[float, float]]


def across(t_s: float) -> tuple[float, float]:
    """Return the place of somebody who crosses x = 5 m from below."""
    return 5.0 + 0.2 * math.sin(t_s), -5.0 + 1.25 * t_s


def along(t_s: float) -> tuple[float, float]:
    return 9.0 - 1.1 * t_s, 1.3


def robot(t_s: float) -> tuple[float, float]:
    return min(1.0 * t_s, 8.0), 0.0


def written(
    path: Path, people: dict[str, Place], *, hz: float = 25.0, noise_m: float = 0.0
) -> Path:
    rng = np.random.default_rng(0)
    rows = ["t_s,id,x_m,y_m"]
    for name, place in people.items():
        for tick in range(round(9.0 * hz)):
            t_s = 100.0 + tick / hz
            x, y = place(tick / hz) + noise_m * rng.standard_normal(2)
            rows.append(f"{t_s:.4f},{name},{x:.6f},{y:.6f}")
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"misses t_s, id, x_m, y_m"),
        ("t_s,id,x,y\n0,a,1,1\n", r"misses x_m, y_m; .* got t_s, id, x, y"),
        ("t_s,id,x_m,y_m\n", r"holds no rows below"),
        (
            "t_s,id,x_m,y_m\n0,a,1,1\n0.1,a,nan,1\n",
            r"line 3: x_m must be a finite number, got 'nan'",
        ),
        ("t_s,id,x_m,y_m\n0,,1,1\n", r"line 2: id is empty"),
        ("t_s,id,x_m,y_m\n0,a,1,1\n", r"line 2: 'a' has one row"),
        (
            "t_s,id,x_m,y_m\n0,a,1,1\n.1,a,1,1\n.05,a,1,1\n",
            r"line 4: 'a' goes back in time, from 0.1",
        ),
        ("t_s,id,x_m,y_m\n0,a,1,1\n0,a,1,1\n", r"line 3: 'a' has two rows for t_s = 0 s"),
        (
            "t_s,id,x_m,y_m\n0,a,1,1\n.1,a,1,1\n.2,a,4,1\n",
            r"line 4: 'a' moves 3 m in 0.1 s.*metres$",
        ),
        ("t_s,id,x_m,y_m\n0,a,1000,1\n.1,a,1120,1\n.2,a,1250,1\n", r"look like millimetres"),
        (
            "t_s,id,x_m,y_m\n0,a,0,0\n.1,a,0,0\n0,b,4000,0\n.1,b,4000,0\n",
            r"over 4000 m.*millimetres",
        ),
        ("t_s,id,x_m,y_m\n0,a,1,1\n33,a,1,1\n66,a,1,1\n", r"are 33 s apart.*t_s is in seconds"),
    ],
)
def test_bad_tables_are_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(SimError, match=message):
        read_table(path)
    assert main(["scenario", "from-recording", str(path), "--out", str(tmp_path / "x.yaml")]) == 2
    assert not (tmp_path / "x.yaml").exists()


def test_short_gaps_are_filled_and_at_long_ones_people_leave(tmp_path: Path) -> None:
    path = tmp_path / "gaps.csv"
    times = [0.0, 0.1, 0.2, 0.6, 0.7, 0.8, 2.0, 2.1, 2.2, 4.0, 6.0, 6.1]
    rows = [f"{t},a,{1.0 + t},2.0,7" for t in times]
    path.write_text("t_s,id,x_m,y_m,speed\n" + "\n".join(rows) + "\n")
    table = read_table(path)
    assert (table.filled_gaps, table.long_gaps, table.lone_rows) == (1, 3, 1)
    assert table.ignored == ("speed",)
    assert [track.name for track in table.of("a")] == ["a", "a (2)", "a (3)"]
    made = scenario_from_recording(path, tmp_path / "gaps.yaml")
    first, second, third = read_recordings(made.people)
    assert (first.times_s[[0, -1]] == [0.0, 0.8]).all()
    np.testing.assert_allclose(np.diff(first.times_s), 0.1)
    np.testing.assert_allclose(first.positions_odom_m[:, 0], 1.0 + first.times_s, atol=1e-4)
    assert (second.times_s[0], third.times_s[-1]) == (2.0, 6.1)
    assert any("1 of at most 0.5 s filled" in remark for remark in made.remarks)


def test_resampling_follows_the_path_and_calms_noise(tmp_path: Path) -> None:
    clean = written(tmp_path / "clean.csv", {"a": across, "b": along})
    noisy = written(tmp_path / "noisy.csv", {"a": across, "b": along}, noise_m=0.02)
    errors = {}
    for path in (clean, noisy):
        made = scenario_from_recording(path, tmp_path / f"{path.stem}.yaml")
        for recording, place in zip(read_recordings(made.people), (across, along), strict=True):
            exact = np.array([place(t) for t in recording.times_s])
            off = recording.positions_odom_m - exact
            errors.setdefault(path.stem, []).append(float(np.sqrt((off**2).mean())))
    assert max(errors["clean"]) < 0.002
    assert max(errors["noisy"]) < 0.014


def test_the_task_is_the_robots_own_or_as_given_or_along_the_longer_side(tmp_path: Path) -> None:
    path = written(tmp_path / "all.csv", {"agv": robot, "a": across, "b": along})

    def task(name: str, **options: object) -> tuple[float, ...]:
        made = scenario_from_recording(
            path,
            tmp_path / f"{name}.yaml",
            RecordingOptions(**options),  # type: ignore[arg-type]
        )
        scenario = Scenario.from_yaml(made.scenario)
        assert drawn_problems(scenario) == ()
        of = scenario.robot
        return of.start_x_m, of.start_y_m, of.goal_x_m, of.goal_y_m

    assert task("own", robot_id="agv") == (0.0, 0.0, 8.0, 0.0)
    names = [recording.name for recording in read_recordings(tmp_path / "own_people.csv")]
    assert names == ["a", "b"]
    assert task("given", robot_id="agv", start_odom_m=(-1.0, 0.5)) == (-1.0, 0.5, 8.0, 0.0)
    start_x, start_y, goal_x, goal_y = task("longer")
    assert (start_x, start_y) == (goal_x, pytest.approx(-6.0))
    assert goal_y > 6.0
    with pytest.raises(SimError, match=r"no rows of the robot 'rob'; its ids are agv, a, b"):
        task("none", robot_id="rob")
    with pytest.raises(SimError, match=r"start \(9, 1.3\) m is 0.00 m from 'b'.*another --start"):
        task("on_top", robot_id="agv", start_odom_m=(9.0, 1.3))
    with pytest.raises(SimError, match=r"nobody has two rows from 200 s on"):
        task("late", from_s=200.0)
    with pytest.raises(SimError, match="less than 1 m apart"):
        task("short", start_odom_m=(0.0, 0.0), goal_odom_m=(0.1, 0.0))
    with pytest.raises(SimError, match="would overwrite the recording"):
        scenario_from_recording(tmp_path / "own_people.csv", tmp_path / "own.yaml")


def test_a_goal_on_top_of_somebody_is_refused_but_not_where_people_pass_or_have_left(
    tmp_path: Path,
) -> None:
    """The robot needs 4 s at least; the walker is over the goal at 6 s."""
    people: dict[str, Place] = {"walks": lambda t: (t, 3.0), "stands": lambda _: (6.0, 0.0)}
    table = written(tmp_path / "a.csv", people)
    for start, goal, what in (
        ((0.0, 0.0), (6.0, 0.0), "goal"),
        ((0.0, 0.0), (6.5, 0.2), "goal"),
        ((6.0, 0.3), (0.0, 0.0), "start"),
    ):
        options = RecordingOptions(start_odom_m=start, goal_odom_m=goal)
        message = rf"the robot's {what} .* from 'stands'.*another --{what}"
        with pytest.raises(SimError, match=message):
            scenario_from_recording(table, tmp_path / "out.yaml", options)
    assert not (tmp_path / "out.yaml").exists()
    rows = table.read_text().splitlines()
    left = [row for row in rows if ",stands," not in row or float(row.split(",")[0]) < 103.5]
    table.write_text("\n".join(left).replace("6.000000,0.000000", "6.000000,3.000000") + "\n")
    options = RecordingOptions(start_odom_m=(0.0, 0.0), goal_odom_m=(6.0, 3.0))
    assert scenario_from_recording(table, tmp_path / "out.yaml", options).scenario.exists()


def test_a_part_of_a_recording_begins_at_time_0_where_it_was_recorded(tmp_path: Path) -> None:
    path = written(tmp_path / "part.csv", {"a": across, "b": along})
    options = RecordingOptions(from_s=102.0, until_s=105.0)
    made = scenario_from_recording(path, tmp_path / "part.yaml", options)
    for recording, place in zip(read_recordings(made.people), (across, along), strict=True):
        assert (recording.times_s[0], recording.times_s[-1]) == (0.0, 3.0)
        np.testing.assert_allclose(recording.positions_odom_m[0], place(2.0), atol=0.01)
    hall = Scenario.from_yaml(made.scenario).layout
    places = np.vstack([each.positions_odom_m for each in read_recordings(made.people)])
    assert (places.min(axis=0) - [hall.x_min_m, hall.y_min_m] >= 3.0).all()
    assert ([hall.x_max_m, hall.y_max_m] - places.max(axis=0) >= 3.0).all()


def test_the_command_says_what_people_do_and_so_does_the_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path / "all.csv", {"agv": robot, "a": across})
    words = ["scenario", "from-recording", str(path), "--robot-id", "agv", "--out"]
    assert main([*words, str(tmp_path / "fixed.yaml")]) == 0
    output = capsys.readouterr().out
    assert "They do not react to the robot." in output
    assert "would come within" in output
    assert f"awarenav crossings --scenario {tmp_path / 'fixed.yaml'}" in output
    assert main([*words, str(tmp_path / "reacts.yaml"), "--react", "--goal", "9", "-1"]) == 0
    reacts = Scenario.from_yaml(tmp_path / "reacts.yaml")
    assert reacts.replay_reacts
    assert (reacts.robot.goal_x_m, reacts.robot.goal_y_m) == (9.0, -1.0)
    assert "until the robot forces them off" in reacts.description
    files = [str(tmp_path / f"{name}.yaml") for name in ("fixed", "reacts")]
    jobs = plan_jobs([*files, "kneels_at_work"], ["balanced"], [0])
    assert recorded_people(jobs) == (
        "The recorded people of fixed do not react to the robot.",
        "The recorded people of reacts leave their paths where the robot forces them off, and "
        "return.",
    )
    drawing = tmp_path / "fixed.png"
    assert main(["scenario", "show", files[0], "--out", str(drawing)]) == 0
    assert drawing.stat().st_size > 5000
    assert main(["scenario", "validate", *files]) == 0
    with pytest.raises(SimError, match="need recorded people"):
        Scenario.from_data({**kneeling(), "replay_reacts": True})


def kneeling() -> dict[str, object]:
    return Scenario.shipped("kneels_at_work").model_dump()


def crossed(
    table: Path,
    out: Path,
    options: RecordingOptions,
    duration_s: float | None = None,
) -> CrossingResult:
    made = scenario_from_recording(table, out, options)
    scenario = Scenario.from_yaml(made.scenario)
    if duration_s is not None:
        scenario = scenario.model_copy(update={"duration_s": duration_s})
    return run_crossing(scenario, policy="balanced")


def off_path_m(result: CrossingResult, people: Path) -> np.ndarray:
    """Return the largest distance of each person from the recording, up to the first contact."""
    until_s = min((contact.t_s for contact in result.contacts), default=math.inf)
    farthest = []
    for index, recording in enumerate(read_recordings(people)):
        frames = [
            frame
            for frame in result.frames
            if recording.times_s[0] <= frame.t_s <= min(recording.times_s[-1], until_s)
        ]
        times = [frame.t_s for frame in frames]
        exact = [
            np.interp(times, recording.times_s, column) for column in recording.positions_odom_m.T
        ]
        real = np.array([frame.truth[index].position_odom_m for frame in frames])
        farthest.append(np.linalg.norm(real - np.column_stack(exact), axis=1).max())
    return np.array(farthest)


def test_people_walk_into_a_robot_or_round_it(tmp_path: Path) -> None:
    people: dict[str, Place] = {"agv": robot, "hurries": lambda t: (1.7 * t - 3.0, 0.05)}
    table = written(tmp_path / "behind.csv", people)
    for react in (False, True):
        out = tmp_path / f"behind_{react}.yaml"
        # Who does not react walks through the robot; what follows is no meeting.
        duration_s = 5.0 if react else 2.0
        result = crossed(table, out, RecordingOptions(react, "agv"), duration_s)
        (off_m,) = off_path_m(result, out.with_name(f"{out.stem}_people.csv"))
        if react:
            assert not result.contact
            assert off_m > 0.15
        else:
            assert result.contact_by == "person"
            assert off_m < 0.05  # the cubic between the rows, and the contact


def test_people_who_left_are_not_measured(tmp_path: Path) -> None:
    people: dict[str, Place] = {"agv": robot, "b": along}
    table = written(tmp_path / "leaves.csv", people)
    options = RecordingOptions(robot_id="agv", until_s=101.0)
    result = crossed(table, tmp_path / "leaves.yaml", options, 2.0)
    there = ~np.isnan(result.people_odom_m[:, 0]).any(axis=1)
    np.testing.assert_array_equal(there, result.t_s < 1.01)


@pytest.mark.skipif(
    not CLIPS, reason="needs recorded clips of people, which are not in the project"
)
@pytest.mark.parametrize(
    ("clip", "react"),
    [
        (clip, react)
        if "front" in clip.stem and not react
        else pytest.param(clip, react, marks=pytest.mark.full)
        for clip in CLIPS
        for react in (False, True)
    ],
    ids=lambda value: value.stem if isinstance(value, Path) else str(value),
)
def test_the_robot_touches_no_one_among_people_who_were_recorded(
    tmp_path: Path, clip: Path, react: bool
) -> None:
    result = crossed(clip, tmp_path / "clip.yaml", RecordingOptions(react))
    assert result.success
    assert result.contact_by != "robot"
    if react:
        assert not result.contact
    else:
        assert off_path_m(result, tmp_path / "clip_people.csv").max() < 0.02
