"""Measured attention of people, and the check of the scenario's word for it against that."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from measured_scenes import crossing

from awarenav.cli import main
from sim_tests import Scenario, run_crossing, shipped_scenarios
from sim_tests.study.measures import MeasuredAttention
from sim_tests.study.scenarios._validate import AttentionCheck, check_attention

T_S = np.arange(0.0, 10.05, 0.1)


def still(t):
    return 0.0, 0.0, 0.0, 0.0


def person_at(x_m):
    return lambda t: (x_m, 0.0, 0.0, 0.0)


def seen(result, could_look):
    """The same crossing in which ``could_look(t, person)`` says who has the robot before them."""
    frames = [
        replace(
            frame,
            truth=tuple(
                replace(view, could_look=could_look(frame.t_s, index))
                for index, view in enumerate(frame.truth)
            ),
        )
        for frame in result.frames
    ]
    return replace(result, frames=tuple(frames))


def measured(people, looks, could_look=lambda t, person: True):
    walks = [person_at(x) for x in people]
    result = seen(crossing(T_S, still, walks, looks=looks), could_look)
    return MeasuredAttention.of(result)


def test_only_the_time_counts_in_which_looking_matters():
    # Looks for the first 3 s; the robot is before the person from 2 s to 6 s: 1 s of 4 s, and 1 s.
    found = measured([3.0], lambda t, i: t < 2.95, lambda t, i: 1.95 < t < 5.95)
    assert found.could_look_s.tolist() == pytest.approx([4.0])
    assert found.aware_s.tolist() == pytest.approx([2.0])
    assert found.looked_s.tolist() == pytest.approx([1.0])
    assert found.least_aware_share == pytest.approx(0.5)


def test_the_least_attentive_person_decides():
    found = measured([3.0, 4.0], lambda t, i: i == 0 or t < 4.95)
    assert found.least_aware_share == pytest.approx(0.6)
    assert found.looked_s.tolist() == pytest.approx([10.0, 5.0])


def checked(label, looks):
    data = {
        "name": "made_up",
        "attention": label,
        "duration_s": 30.0,
        "layout": "open",
        "robot": {"goal_x_m": 11.0},
        "people": [{"name": "worker", "route": [{"x_m": 3.0, "y_m": 0.0}]}],
    }
    result = crossing(T_S, still, [person_at(3.0)], looks=looks)
    return AttentionCheck.of(Scenario.from_data(data), [result])


@pytest.mark.parametrize(
    ("label", "share", "contradicts"),
    [
        ("attentive", 0.71, False),  # and a second more
        ("attentive", 0.69, True),
        ("unaware", 0.24, False),
        ("unaware", 0.26, True),
        ("mixed", 1.0, False),
        ("mixed", 0.0, False),
    ],
)
def test_labels_are_contradicted_by_what_people_do(label, share, contradicts):
    check = checked(label, lambda t, i: t < 10.0 * share - 0.05)
    assert bool(check.contradictions) == contradicts
    for sentence in check.contradictions:
        assert f"attention: {label}, but worker" in sentence
        assert "of 10.0 s" in sentence


def test_a_person_can_look_at_a_robot_ahead_and_in_sight_only():
    """In the aisle until they have passed each other; round the corner not before the rack ends."""
    scenario = Scenario.shipped("head_on_in_aisle").draw(0)
    frames = run_crossing(scenario, policy="balanced", perception="truth", seed=0).frames
    for frame in frames:
        view, ahead_m = frame.truth[0], frame.T_odom_camera[0, 3]
        distance_m = view.position_odom_m[0] - ahead_m
        if abs(distance_m) > 0.5:
            assert view.could_look == (distance_m > 0.0)
    begun = Scenario.shipped("crossing_from_left").draw(0)
    begun = begun.model_copy(update={"duration_s": 0.2})
    first = run_crossing(begun, policy="balanced", perception="truth", seed=0).frames[0].truth[0]
    assert not first.could_look
    assert first.awareness == 0.0


def wrongly_labelled(folder: Path, name: str, label: str) -> Path:
    scenario = Scenario.shipped(name)
    path = folder / f"{name}.yaml"
    text = scenario.to_text()
    path.write_text(text.replace(f"attention: {scenario.attention}", f"attention: {label}"))
    return path


def test_validate_names_a_wrong_label_with_what_was_measured(tmp_path, capsys):
    said_attentive = wrongly_labelled(tmp_path, "crossing_distracted", "attentive")
    said_unaware = wrongly_labelled(tmp_path, "crossing_attentive", "unaware")
    files = [str(said_attentive), str(said_unaware)]
    assert main(["scenario", "validate", "--episodes", "1", *files]) == 1
    output = capsys.readouterr().out
    assert output.count("can be run, but its attention is wrong") == 2
    assert "attention: attentive, but worker had looked at the robot within 1 s for 0%" in output
    assert "attention: unaware, but worker looked at the robot" in output
    assert "0 numbers vary" in output
    assert main(["scenario", "validate", "--episodes", "0", *files]) == 0


@pytest.mark.full
@pytest.mark.slow
@pytest.mark.parametrize("name", shipped_scenarios())
def test_people_of_shipped_scenarios_do_what_their_label_says(name):
    check = check_attention(Scenario.shipped(name), range(3))
    assert check.contradictions == ()
    assert not any(math.isnan(each.aware_share) for each in check.people)
