"""Races of trials against the base policy, what is held out, and when a policy beats another."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nav_adapter import AwarenessPolicy
from sim_tests import SimError
from sim_tests.scenario import ScenarioTemplate, shipped_templates
from sim_tests.search._files import common_settings
from sim_tests.search.tune import Evaluation
from sim_tests.search.tune._finalists import (
    BEATS_BASE,
    Candidate,
    beats,
    level_of,
    merged,
    named_winner,
)
from sim_tests.search.tune._race import dropped, stages
from sim_tests.search.tune._results import _header, table_lines
from sim_tests.search.tune._settings import TuneSettings, held_out_scenarios
from sim_tests.search.tune._tune import Tuning
from sim_tests.search.tune._verdict import is_undecided, verdict_text
from sim_tests.study.measures import EpisodeRecord

_TASKS = [(scenario, seed) for scenario in "abcdef" for seed in range(5)]


def _evaluation(
    time_s=5.0, risk=0.0, *, tasks=_TASKS, contacts=0, spread=0.3, name="p", requests=0
):
    """Episodes of which each scenario and seed has the same chance part in every policy."""
    records = []
    for row, (scenario, seed) in enumerate(tasks):
        chance = np.random.default_rng([ord(scenario), seed]).normal()
        own = np.random.default_rng([ord(scenario), seed, round(100 * time_s)]).normal()
        records.append(
            EpisodeRecord(
                *(scenario, seed, name, "q", "truth"),
                time_lost_s=time_s + 2.0 * chance + spread * own,
                step_out_unaware=risk,
                moving_contacts=int(row < contacts),
                requests=requests,
            )
        )
    return Evaluation.of(records)


@given(st.integers(1, 200), st.integers(0, 10**6))
def test_stages_are_the_seeds_in_order_and_double_what_has_run(count, first):
    seeds = range(first, first + count)
    parts = list(stages(seeds))
    assert list(itertools.chain(*parts)) == list(seeds)
    done = list(itertools.accumulate(map(len, parts)))
    assert all(after == min(2 * before, count) for before, after in itertools.pairwise(done))
    # More seeds keep the earlier parts, so that their files serve again.
    assert list(stages(range(first, first + 2 * count)))[: len(parts) - 1] == parts[:-1]


def test_a_trial_that_is_shown_to_lose_is_dropped_and_an_open_one_goes_on():
    base = _evaluation()
    assert dropped(_evaluation(6.5), base, 0.5) == "loses"
    assert dropped(_evaluation(3.5), base, 0.5) == ""
    assert dropped(_evaluation(5.01), base, 0.5) == ""
    # Too few pairs show nothing, a contact is enough.
    few = _TASKS[:6]
    assert dropped(_evaluation(6.5, tasks=few), base, 0.5) == ""
    assert dropped(_evaluation(3.5, 0.7, tasks=few), base, 0.5) == ""
    assert dropped(_evaluation(3.5, tasks=few, contacts=1), base, 0.5) == "contact"


def test_a_trial_above_the_risk_is_dropped_however_fast_it_is():
    base = _evaluation()
    assert dropped(_evaluation(3.5, 0.6), base, 0.5) == "risk"
    assert dropped(_evaluation(3.5, 0.5), base, 0.5) == ""
    # The base policy is above the risk itself: a slower policy within it is what is looked for.
    assert dropped(_evaluation(6.5, 0.4), _evaluation(risk=0.6), 0.5) == ""


def test_the_estimate_from_few_episodes_uses_the_base_policy_on_the_same():
    base, whole = _evaluation(), _evaluation(6.0)
    assert whole.estimate(base) == whole.figures
    rng = np.random.default_rng(0)
    errors_s = []
    for _ in range(50):
        rows = rng.choice(len(_TASKS), 8, replace=False)
        part = _evaluation(6.0, tasks=[_TASKS[row] for row in rows])
        errors_s.append([part.estimate(base)[0], part.figures[0]])
    paired_s, plain_s = np.std(np.array(errors_s) - whole.figures[0], axis=0)
    assert paired_s < 0.3 * plain_s


def test_a_third_of_the_scenarios_is_held_out_of_every_kind_of_attention():
    templates = shipped_templates()
    held_out = held_out_scenarios(["third"], templates)
    assert held_out == held_out_scenarios(["third"], templates[::-1])
    assert abs(len(held_out) - len(templates) / 3) < 1
    kinds = {each.attention for each in templates if each.name in held_out}
    assert kinds == {"attentive", "mixed", "unaware"}
    assert held_out_scenarios(["third"], templates[:2]) == ()
    assert held_out_scenarios(["none"], templates) == ()
    assert held_out_scenarios(["runs_out"], templates) == ("runs_out",)


@pytest.mark.parametrize(
    ("given_names", "message"),
    [
        (["runs_ot"], "did you mean 'runs_out'"),
        (["runs_out"], "must leave a scenario to tune on"),
    ],
)
def test_scenarios_that_cannot_be_held_out_are_refused(given_names, message):
    with pytest.raises(SimError, match=message):
        held_out_scenarios(given_names, [ScenarioTemplate.shipped("runs_out")])


def _candidate(name: str, number: int | None = 1, **values) -> Candidate:
    held_out = values.pop("held_out", None) or _evaluation(**values)
    policy = AwarenessPolicy.preset("balanced")
    if number is not None:
        timing = policy.timing.model_copy(update={"hold_s": 1.0 + 0.01 * number})
        policy = policy.model_copy(update={"timing": timing})
    return Candidate((name,), number, policy, _evaluation(values.get("time_s", 5.0)), held_out)


def test_a_policy_beats_another_only_when_the_interval_says_so():
    base = _candidate("base", None)
    assert beats(_candidate("better", time_s=4.0), base, 0.5, (), 0.95)
    assert not beats(_candidate("equal", time_s=4.99), base, 0.5, (), 0.95)
    assert not beats(_candidate("worse", time_s=6.0), base, 0.5, (), 0.95)
    assert not beats(_candidate("few", time_s=4.0, tasks=_TASKS[:15]), base, 0.5, (), 0.95)
    assert not beats(_candidate("touches", time_s=4.0, contacts=1), base, 0.5, (), 0.95)
    assert not beats(_candidate("risky", time_s=4.0, risk=0.6), base, 0.5, (), 0.95)


def test_a_policy_within_the_risk_beats_one_above_it_though_it_is_slower():
    base = _candidate("base", None, risk=0.6)
    assert beats(_candidate("careful", time_s=6.0, risk=0.4), base, 0.5, (), 0.95)
    assert not beats(_candidate("risky", time_s=4.0, risk=0.55), base, 0.5, (), 0.95)


def test_a_policy_that_asks_too_often_beats_nobody():
    base, asks = _candidate("base", None), _candidate("asks", time_s=4.0, requests=2)
    assert beats(asks, base, 0.5, (), 0.95)
    assert beats(asks, base, 0.5, (), 0.95, requests=2.0)
    assert not beats(asks, base, 0.5, (), 0.95, requests=1.9)
    # The base policy asks too often itself: a slower one that asks less is what is looked for.
    loud, quiet = _candidate("loud", None, requests=3), _candidate("quiet", time_s=6.0, requests=1)
    assert not beats(quiet, loud, 0.5, (), 0.95)
    assert beats(quiet, loud, 0.5, (), 0.95, requests=1.0)


def test_a_gain_must_hold_in_the_held_out_scenarios():
    base = _candidate("base", None)
    gains = _evaluation(3.0, tasks=_TASKS[:20])
    loses = _evaluation(6.0, tasks=_TASKS[20:])
    mixed = _candidate("mixed", held_out=Evaluation.joined([gains, loses]))
    assert beats(mixed, base, 0.5, (), 0.95)
    assert beats(mixed, base, 0.5, "ab", 0.95)
    assert not beats(mixed, base, 0.5, "ef", 0.95)


def test_the_winner_gets_the_name_and_more_finalists_need_a_wider_interval():
    base = _candidate("base", None)
    rows = [_candidate("second", 1, time_s=4.2), _candidate("other", 2, time_s=4.0)]
    names = [each.names for each in named_winner(rows, base, 0.5, ())]
    assert names == [("second",), (BEATS_BASE, "other")]
    assert [each.names for each in named_winner(rows[:0], base, 0.5, ())] == []
    assert named_winner([_candidate("second", 1, time_s=5.5)], base, 0.5, ())[0].names == (
        "second",
    )
    assert level_of(1) == 0.95
    assert level_of(4) == pytest.approx(0.9875)


def test_equal_policies_and_equal_episodes_are_one_row():
    base, same_policy = _candidate("base", None), _candidate("second", None)
    same_episodes = _candidate("third", 3)
    other = _candidate("least_time_lost", 4, time_s=4.0)
    rows = merged([base, other, same_policy, same_episodes])
    assert [each.names for each in rows] == [
        ("base", "second", "third"),
        ("least_time_lost",),
    ]
    assert rows[0].trial is None


def _tuning(*chosen: Candidate, hold_out=("e", "f"), requests=None) -> Tuning:
    settings = TuneSettings(
        *("balanced", "{}", (), {}, 10, 5, 5, "truth", "", 0, "tpe", 4),
        hold_out_scenarios=hold_out,
        requests=requests,
    )
    base = _candidate("balanced", None)
    rows = tuple(named_winner(chosen, base, 0.5, hold_out, requests))
    return Tuning(settings, None, None, (), ("a trial",), (base,), rows, 0.5, 0.5)


def test_the_verdict_names_a_winner_with_its_intervals_and_says_that_it_was_not_falsified():
    tuning = _tuning(_candidate("second", 7, time_s=4.0))
    text = verdict_text(tuning)
    assert text.startswith("beats_base (trial 7, second) is better than balanced. On 30 held-out ")
    alone = tuning.winner.held_out.within("ef").minus(tuning.base.held_out, "time_lost_s")
    assert f"in the 2 held-out scenarios alone it loses {-alone.value:.2f} s less" in text
    assert "(95 % intervals)" in text
    allowed = "It has 0.00 step-out impacts per 1 000 crossings, balanced 0.00; 0.50 are allowed."
    assert allowed in text
    assert "The moving robot touched nobody (at most 9.5 % with 95 % confidence)." in text
    assert text.endswith("It has not been falsified yet.")


@pytest.mark.parametrize(
    ("values", "reason", "undecided"),
    [
        ({"time_s": 4.88}, "a difference is not shown", True),
        ({"time_s": 6.0}, "it is shown to lose more time", False),
        ({"time_s": 4.0, "contacts": 2}, "the moving robot and a person touched", False),
        ({"time_s": 4.0, "risk": 0.7}, "it is above the risk", False),
        ({"time_s": 4.0, "tasks": _TASKS[:15]}, "fewer than 20 pairs", True),
    ],
)
def test_the_verdict_keeps_the_base_policy_and_says_why(values, reason, undecided):
    tuning = _tuning(_candidate("second", 7, **values))
    text = verdict_text(tuning)
    assert text.startswith(f"keep balanced. The nearest is second (trial 7): {reason}")
    assert is_undecided(tuning) == undecided


def test_requests_per_crossing_are_said_where_somebody_asked():
    silent, asks = _candidate("second", 7, time_s=4.0), _candidate("second", 7, requests=2)
    assert "requests" not in verdict_text(_tuning(silent))
    assert "requests" not in "\n".join(table_lines(_tuning(silent)))
    said = "It makes 2.00 requests for attention per crossing, balanced 0.00"
    assert f"{said}." in verdict_text(_tuning(asks))
    bounded = _tuning(_candidate("second", 7, time_s=4.0, requests=2), requests=1.5)
    text = verdict_text(bounded)
    assert "second (trial 7): it asks for attention too often on held-out episodes" in text
    assert f"{said}; 1.5 are allowed." in text
    assert not is_undecided(bounded)
    lines = table_lines(bounded)
    assert lines[1].split().count("requests") == 2
    assert [line.split()[-1] for line in lines[2:4]] == ["0.00", "2.00"]
    assert "At most 1.5 requests for attention per crossing." in lines
    assert len(set(map(len, lines[1:4]))) == 1


def test_the_verdict_says_that_no_scenario_was_held_out():
    text = verdict_text(_tuning(_candidate("second", 7, time_s=4.0), hold_out=()))
    assert "no scenario was held out" in text


@pytest.mark.parametrize(
    ("robot", "population", "words"),
    [
        ("", "", "(tpe, seed 0, perception truth)."),
        ("omni", "", "(tpe, seed 0, perception truth, robot omni)."),
        ("omni", "recorded", "(tpe, seed 0, perception truth, robot omni, recorded people)."),
    ],
)
def test_a_chosen_policy_says_for_which_robot_and_people_it_was_tuned(robot, population, words):
    second = _candidate("second", 7, time_s=4.0)
    tuning = _tuning(second)
    common = common_settings("balanced", ["runs_out"], "", population, robot)
    settings = dataclasses.replace(tuning.settings, scenarios=common["scenarios"])
    header = _header(dataclasses.replace(tuning, settings=settings), second, "second")
    assert words in header.splitlines()[0]
