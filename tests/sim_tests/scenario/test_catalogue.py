import numpy as np
import pytest
from paths import ROOT
from PIL import Image

from awarenav.cli import main
from sim_tests import Scenario, SimError, run_crossing, shipped_scenarios
from sim_tests.actors.behaviour import PersonSpec
from sim_tests.scenario import SCENARIO_SETS, RobotTask
from sim_tests.scenario.catalogue import (
    approach_statistics,
    closest_approaches,
    drawn_problems,
    person_plan,
    robot_plan,
    scenario_problems,
)
from sim_tests.study.scenarios._validate import AttentionCheck

# Their people stop beside the robot's path on purpose.
BESIDE = {"crossing_attentive", "crossing_distracted", "paper_encounter"}


SHIPPED = [name for each in SCENARIO_SETS for name in shipped_scenarios(each)]


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_scenarios_can_be_run_and_are_what_they_say(name):
    scenario = Scenario.shipped(name)
    assert drawn_problems(scenario) == ()
    assert scenario.duration_s <= 40.0
    if name in BESIDE:
        return
    # Robot and people would come close if nobody reacted, but not at the start.
    statistics = approach_statistics(scenario, 100)
    assert statistics is not None
    assert statistics.conflict_share >= 0.8
    assert statistics.median_time_s > 2.0
    glances = [each.glances for each in scenario.people]
    notices_m = [each.notices_within_m for each in glances]
    if scenario.attention == "attentive":
        assert all(each.watches for each in glances)
        assert min(notices_m) > 8.0
    else:
        assert (max(notices_m) > 0.0) == (scenario.attention == "mixed")


def test_the_gallery_has_a_picture_of_every_scenario():
    pictures = ROOT / "docs" / "images" / "scenarios"
    assert {path.stem for path in pictures.glob("*.png")} >= set(SHIPPED)


def test_crossings_from_left_and_right_are_mirror_images():
    left, right = (
        Scenario.shipped(f"crossing_from_{side}").draw(11).people[0] for side in ("left", "right")
    )
    assert left.route[0].y_m > 0.0 > right.route[0].y_m
    mirrored = tuple(point.model_copy(update={"y_m": -point.y_m}) for point in right.route)
    assert right.model_copy(update={"route": mirrored}) == left


def test_plans_follow_uniform_motion():
    t_s = np.array([0.0, 1.0, 1.5, 3.5, 100.0])
    robot = robot_plan(RobotTask(goal_x_m=6.0, goal_y_m=8.0), t_s)
    # At 1 m/s² to 1.5 m/s, then at constant speed, along a line of slope 4/3.
    along = np.array([0.0, 0.5, 1.125, 4.125, 10.0])
    np.testing.assert_allclose(robot, along[:, None] * [0.6, 0.8], atol=1e-12)

    route = ({"x_m": 0, "y_m": 0}, {"x_m": 4, "y_m": 0}, {"x_m": 4, "y_m": 4})
    spec = PersonSpec(
        name="a", route=route, speed_mps=2.0, start_s=1.0, pauses=({"at_m": 3.0, "for_s": 2.0},)
    )
    times = np.array([0.0, 1.5, 2.5, 4.4, 5.5, 9.0])
    path, walked = person_plan(spec, times)
    np.testing.assert_allclose(walked, [0, 1, 3, 3, 5, 8])
    np.testing.assert_allclose(path, [[0, 0], [1, 0], [3, 0], [3, 0], [4, 1], [4, 4]])

    back = spec.model_copy(update={"turns_back_at_m": 5.0, "pauses": ()})
    path, walked = person_plan(back, np.array([3.5, 4.5, 9.0]))
    np.testing.assert_allclose(path, [[4, 1], [3, 0], [0, 0]])
    np.testing.assert_allclose(walked, [5, 7, 10])


def test_the_closest_approach_agrees_with_the_closed_form():
    # Both at constant speed on perpendicular lines: distance = delay · v_r v_p / √(v_r² + v_p²).
    data = {
        "name": "a",
        "duration_s": 30.0,
        "layout": "open",
        "robot": {"goal_x_m": 11.0},
        "people": [
            {
                "name": "p",
                "route": [{"x_m": 6.0, "y_m": 4.0}, {"x_m": 6.0, "y_m": -4.0}],
                "speed_mps": 1.2,
                "start_s": 2.0,
            }
        ],
    }
    delay_s = (6.0 / 1.5 + 0.75) - (2.0 + 4.0 / 1.2)
    expected = abs(delay_s) * 1.5 * 1.2 / np.hypot(1.5, 1.2)
    distance, _ = closest_approaches(Scenario.from_data(data))["p"]
    assert distance == pytest.approx(expected, abs=1e-3)


def changed(name, **person):
    data = Scenario.shipped(name).model_dump()
    data["people"][0].update(person)
    return Scenario.from_data(data)


def test_impossible_positions_are_reported():
    inside = changed("crossing_from_left", route=({"x_m": 0, "y_m": 2.4}, {"x_m": 7.8, "y_m": 0}))
    assert any("route point 0 at (0, 2.4) m is in" in each for each in scenario_problems(inside))
    through = changed("crossing_from_left", route=({"x_m": 0, "y_m": 0}, {"x_m": 0, "y_m": 4}))
    found = scenario_problems(through)
    assert any("from route point 0 to 1 leads through" in each for each in found)
    outside = changed("crossing_from_left", route=({"x_m": 99, "y_m": 0},))
    assert any("outside the hall" in each for each in scenario_problems(outside))
    ends = {"turns_back_at_m": 20.0, "pauses": ({"at_m": 14.0, "for_s": 1.0},)}
    stops = scenario_problems(changed("crossing_from_left", **ends))
    assert [each.partition(" is not before the end of the")[0] for each in stops] == [
        "people: worker: turns_back_at_m 20",
        "people: worker: the pause at_m 14",
    ]
    back = {"turns_back_at_m": 4.0, "pauses": ({"at_m": 7.9, "for_s": 1.0},)}
    assert scenario_problems(changed("crossing_from_left", **back)) == ()
    back["pauses"] = ({"at_m": 8.1, "for_s": 1.0},)
    (beyond,) = scenario_problems(changed("crossing_from_left", **back))
    assert "8.1 is not before the end of the way of 8 m" in beyond
    replay = inside.model_copy(update={"people": (), "replay_csv": "nowhere.csv"})
    assert scenario_problems(replay) == ("replay_csv: there is no file nowhere.csv",)


def test_a_problem_of_a_draw_names_its_seed_once():
    person = {"name": "a", "speed_mps": {"choice": [-1.0, 1.0, 1.2]}}
    person["route"] = [{"x_m": 4.0, "y_m": 0.0}, {"x_m": 6.0, "y_m": 0.0}]
    data = {"name": "mine", "duration_s": 9.0, "robot": {"goal_x_m": 9.0}, "people": [person]}
    problems = [each for each in drawn_problems(Scenario.from_data(data)) if "speed_mps" in each]
    assert [each.count("seed") for each in problems] == [1]


def test_show_describes_what_varies_and_writes_yaml_that_can_be_read_back(capsys, tmp_path):
    assert main(["scenario", "show", "stops_midway"]) == 0
    output = capsys.readouterr().out
    assert "people.0.pauses.0.for_s" in output
    assert "of 200 draws" in output
    assert main(["scenario", "show", "stops_midway", "--yaml"]) == 0
    path = tmp_path / "mine.yaml"
    path.write_text(capsys.readouterr().out)
    assert Scenario.from_yaml(path) == Scenario.shipped("stops_midway")
    assert main(["scenario", "show", "stops_midway", "--yaml", "--seed", "4"]) == 0
    path.write_text(capsys.readouterr().out)
    drawn = Scenario.shipped("stops_midway").draw(4)
    assert Scenario.from_yaml(path) == drawn
    assert main(["scenario", "show", "stops_midway", "--seed", "4"]) == 2


def test_validate_accepts_good_files_and_reports_bad_ones(capsys, tmp_path):
    good, bad, idle = (tmp_path / f"{name}.yaml" for name in ("good", "bad", "idle"))
    text = Scenario.shipped("reads_phone").to_text()
    good.write_text(text)
    bad.write_text(text.replace("x_m: 7.8", "x_m: 70.8"))
    idle.write_text(text.replace("low: 0.0", "low: 18.0").replace("high: 1.0", "high: 19.0"))
    assert main(["scenario", "validate", "--episodes", "0", str(good), str(idle)]) == 0
    output = capsys.readouterr().out
    assert "reads_phone@1, 2 numbers vary: can be run" in output
    assert "in 0% of 100 draws: it hardly tests the robot" in output
    assert main(["scenario", "validate", "--episodes", "0", str(good), str(bad)]) == 2
    output = capsys.readouterr().out
    assert "outside the hall" in output
    assert output.count("route point 0") == 1


def test_drawings_are_reproducible(tmp_path, capsys):
    first, second = (tmp_path / f"{name}.png" for name in ("one", "two"))
    for file in (first, second):
        assert main(["scenario", "show", "intersection", "--out", str(file)]) == 0
    assert first.read_bytes() == second.read_bytes()
    with Image.open(first) as image:
        pixels = np.asarray(image.convert("RGB")).reshape(-1, 3)
    # It contains the robot's blue and the hall's grey.
    for colour in ((0x1F, 0x5F, 0x8B), (0xC9, 0xCC, 0xD1)):
        assert (np.abs(pixels - np.array(colour)).max(axis=1) <= 6).sum() > 200
    for name, file in (("intersection", "x.txt"), ("nobody", "x.png")):
        assert main(["scenario", "show", name, "--out", str(tmp_path / file)]) == 2
        assert not (tmp_path / file).exists()
    with pytest.raises(SimError, match="did you mean 'late_glance'"):
        Scenario.named("late_glanc")


def test_the_lane_is_free_and_the_area_beyond_is_not():
    scenario = Scenario.shipped("crossing_from_left")
    hall = scenario.layout.obstacle_boxes_odom
    boxes = scenario.planner_boxes_odom_m
    np.testing.assert_array_equal(boxes[: len(hall)], hall)
    lane = scenario.robot.lane_half_width_m
    for x in (0.0, 7.5, 12.0):
        for y, closed in ((0.0, False), (lane - 0.01, False), (lane + 0.01, True), (-4.0, True)):
            inside = (boxes[:, :2] < (x, y)).all(axis=1) & (boxes[:, 2:] > (x, y)).all(axis=1)
            assert inside.any() == closed
    plain = Scenario.shipped("crossing_attentive")
    np.testing.assert_array_equal(plain.planner_boxes_odom_m, plain.layout.obstacle_boxes_odom)
    with pytest.raises(SimError, match="needs a start and goal along odom x or y"):
        Scenario.from_data(
            {
                "name": "a",
                "duration_s": 5.0,
                "robot": {"goal_x_m": 5.0, "goal_y_m": 2.0, "lane_half_width_m": 1.0},
            }
        )


def test_a_lane_along_y_is_the_rotated_lane_along_x():
    task = {"goal_x_m": 0.0, "goal_y_m": 4.0, "lane_half_width_m": 1.0}
    turned = Scenario.from_data({"name": "a", "duration_s": 5.0, "layout": "open", "robot": task})
    beyond = turned.planner_boxes_odom_m[-2:]
    np.testing.assert_allclose(beyond, [[-5.0, -7.0, -1.0, 7.0], [1.0, -7.0, 14.0, 7.0]])


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.full)])
@pytest.mark.parametrize("name", sorted(set(shipped_scenarios()) - {"paper_encounter"}))
def test_the_robot_reaches_its_goal_without_hitting_anybody(name, seed):
    scenario = Scenario.shipped(name).draw(seed)
    deaf = "answers=0,startles=0"  # what people do by themselves counts
    result = run_crossing(scenario, policy="balanced", seed=seed, population=deaf)
    assert result.success
    assert result.contact_by != "robot"
    # What its people look at is what it says of them.
    check = AttentionCheck.of(Scenario.shipped(name), [result])
    assert check.contradictions == ()
