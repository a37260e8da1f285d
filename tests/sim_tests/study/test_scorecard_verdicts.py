"""Verdicts on planners whose episodes are made up."""

from __future__ import annotations

from dataclasses import replace

import pytest

from sim_tests.study.measures import Conduct, EpisodeRecord, proportion_interval
from sim_tests.study.scorecard import PlannerScore, RadiiUse, Scorecard
from sim_tests.study.scorecard._scoring import _Episode, _radii_use, _score
from sim_tests.study.scorecard._tables import csv_text, markdown
from sim_tests.study.scorecard._verdict import factor, verdicts

EPISODES = 25
GOOD = Conduct(0.0, -0.1, 200, 0.002, 0.004, 0.05)


def episodes(policy, lost_s, *, planner="Mine", conduct=GOOD, change=None):
    """Episodes that lose about so much time; ``change(number)`` gives other values of a row."""
    found = []
    for seed in range(EPISODES):
        attention = "unaware" if seed % 2 else "mixed"
        record = EpisodeRecord(
            "made_up", seed, policy, planner, "truth", success=True, attention=attention,
            time_to_goal_s=10.0 + lost_s, duration_s=10.0 + lost_s, path_length_m=9.0,
            time_lost_s=lost_s + 0.01 * (seed % 3), min_separation_m=1.0, min_margin_m=0.2,
        )  # fmt: skip
        found.append(_Episode(seed, replace(record, **(change(seed) if change else {})), conduct))
    return found


def verdict(mine, blind, *, reference=(), radii=None):
    scores = (
        _score("Mine", "blind", blind, blind, ()),
        _score("Mine", "balanced", mine, blind, reference),
    )
    planner = PlannerScore("Mine", "my:Mine", scores, radii, None, (), True)
    card = Scorecard(
        (planner,), "balanced", "balanced, radii × 2", ("made_up",), (0, 24), "truth", 50, 50, ""
    )
    (found,) = verdicts(card)
    assert csv_text(card).count("\n") == 3
    assert "| Mine | balanced |" in markdown(card)
    return found, {mark.text: mark.tone for mark in found.marks}


def test_a_good_planner_is_said_to_be_good_with_what_the_episodes_can_show():
    found, marks = verdict(episodes("balanced", 3.0), episodes("blind", 5.0))
    assert "It reaches the goal in 25 of 25 episodes with balanced (at least 89" in found.text
    assert "It obeys the speed limit and the yaw rule." in found.text
    assert "With balanced it loses 2.0 s less than with blind (95 % interval" in found.text
    assert "too few" not in found.text
    assert "−2.0 s with unaware people" in found.text
    assert marks["25 of 25 goals"] == marks["margin 0.20 m"] == marks["speed limit"] == "good"
    assert marks["−2.0 s against blind"] == "good"


def test_more_time_than_with_blind_is_bad():
    found, marks = verdict(episodes("balanced", 6.5), episodes("blind", 5.0))
    assert "it loses 1.5 s more than with blind" in found.text
    assert marks["+1.5 s against blind"] == "bad"


def test_few_pairs_are_called_few():
    found, marks = verdict(episodes("balanced", 3.0)[:6], episodes("blind", 5.0)[:6])
    assert "too few pairs to tell" in found.text
    assert marks["−2.0 s against blind"] == "open"


def test_contacts_margins_and_missed_goals_come_with_intervals():
    def change(seed):
        if seed < 2:
            return {"time_to_goal_s": None, "success": False}
        if seed < 5:
            return {"min_margin_m": -0.12, "robot_contacts": 1, "contact": True}
        return {}

    found, marks = verdict(episodes("balanced", 3.0, change=change), episodes("blind", 5.0))
    share = proportion_interval(3, 25)
    ends = f"{100 * share.low:.1f} % to {100 * share.high:.0f} %".replace(" %", "\u202f%")
    assert "It reaches the goal in 23 of 25 episodes" in found.text
    assert f"The robot moved into a person in 3 of 25 episodes ({ends})" in found.text
    assert f"negative in 3 of 25 episodes ({ends}), at worst −0.12 m" in found.text
    assert marks["contact in 3 of 25"] == marks["margin −0.12 m"] == "bad"
    assert marks["23 of 25 goals"] == "bad"


@pytest.mark.parametrize(
    ("conduct", "text", "mark"),
    [
        (replace(GOOD, limit_excess_mps=0.4), "breaks the speed limit in 25 of 25 episodes, by up "
         "to 0.40 m/s. It obeys the yaw rule.", "speed limit +0.40 m/s"),
        (replace(GOOD, fastest_point_excess_mps=0.05), "obeys the speed limit. It breaks the yaw "
         "rule in 25 of 25 episodes, by up to 0.05 m/s.", "yaw rule +0.05 m/s"),
        (replace(GOOD, plan_p99_s=0.08), "It is too slow: its 99th percentile is longer",
         "too slow"),
    ],
)  # fmt: skip
def test_a_broken_limit_and_a_late_command_are_named(conduct, text, mark):
    mine = episodes("balanced", 3.0, conduct=conduct)
    found, marks = verdict(mine, episodes("blind", 5.0))
    assert text in found.text
    assert marks[mark] == "bad"


def test_the_time_of_a_call_is_compared_on_the_same_episodes():
    slow = replace(GOOD, plan_median_s=0.008)
    reference = episodes("balanced", 3.0, planner="SamplingPlanner")
    mine = episodes("balanced", 3.0, conduct=slow)
    found, _ = verdict(mine, episodes("blind", 5.0), reference=reference[3:])
    assert "A call of plan() takes 8.0 ms, 4.0 times the reference planner's time." in found.text
    assert [factor(ratio) for ratio in (0.0041, 0.34, 3.04, 27.2)] == ["0.004", "0.34", "3.0", "27"]


def test_an_episode_without_a_conduct_says_nothing_about_limits():
    found, marks = verdict(episodes("balanced", 3.0, conduct=None), episodes("blind", 5.0))
    assert "limit" not in found.text
    assert "plan()" not in found.text
    assert "speed limit" not in marks


def test_radii_are_ignored_only_where_somebody_came_near():
    mine, blind = episodes("balanced", 3.0), episodes("blind", 5.0)
    same = episodes("balanced, radii × 2", 3.0)
    near, marks = verdict(mine, blind, radii=_radii_use(mine, same, 2.0))
    assert "It does not use the radii" in near.text
    assert marks["ignores radii"] == "bad"
    far, marks = verdict(mine, blind, radii=_radii_use(mine, same, 1.2))
    assert "Nobody came near enough to tell whether it uses the radii" in far.text
    assert "ignores radii" not in marks


def test_radii_are_used_where_the_path_or_the_distance_changes():
    mine = episodes("balanced", 3.0)
    wide = episodes(
        "wide", 4.0, change=lambda seed: {"min_separation_m": 1.3 if seed < 5 else 1.004}
    )
    use = _radii_use(mine, wide[:10], 2.0)
    assert (use.changed.value, use.changed.n) == (0.5, 10)
    assert use.separation_m.value == pytest.approx(0.152)
    found, marks = verdict(mine, episodes("blind", 5.0), radii=use)
    assert "path is another in 5 of 10 episodes, and it keeps 0.15 m more distance" in found.text
    assert marks["uses radii"] == "good"
    failed = episodes("wide", 4.0, change=lambda seed: {"error": "RuntimeError: no"})
    assert _radii_use(mine, failed, 2.0) is None
    assert isinstance(use, RadiiUse)
