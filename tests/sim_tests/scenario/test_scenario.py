import pytest

from sim_tests import Scenario, SimError, shipped_scenarios


@pytest.mark.parametrize("name", shipped_scenarios())
def test_shipped_scenarios_are_valid_and_round_trip(name, tmp_path):
    scenario = Scenario.shipped(name)
    assert scenario.name == name
    assert scenario.description.endswith(".")
    scenario.to_yaml(tmp_path / "copy.yaml")
    assert Scenario.from_yaml(tmp_path / "copy.yaml") == scenario


def test_attentive_and_distracted_differ_only_in_the_gaze():
    first, second = (Scenario.shipped(f"crossing_{who}") for who in ("attentive", "distracted"))
    same = {"name": "", "description": "", "attention": "mixed", "workers": ()}
    assert first.model_copy(update=same) == second.model_copy(update=same)
    assert first.workers[0].path == second.workers[0].path
    assert first.workers[0].gaze != second.workers[0].gaze


def test_unknown_names_are_refused_with_the_nearest_valid_name():
    with pytest.raises(SimError, match="did you mean 'paper_encounter'"):
        Scenario.shipped("paper_encountr")


def test_files_with_unknown_keys_or_layouts_are_refused_with_the_valid_ones(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("name: a\nduration_s: 5\nrobot: {goal_x_m: 3, gaol_y_m: 1}\n")
    with pytest.raises(SimError, match="did you mean 'goal_y_m'"):
        Scenario.from_yaml(path)
    path.write_text("name: a\nduration_s: 5\nlayout: maze\nrobot: {goal_x_m: 3}\n")
    with pytest.raises(SimError, match="'crossing', 'open'"):
        Scenario.from_yaml(path)
    path.write_text("name: a\nduration_s: -5\nrobot: {goal_x_m: 3}\n")
    with pytest.raises(SimError, match="duration_s"):
        Scenario.from_yaml(path)
