"""Tuning: the space of policies, races of trials, what is held out, and when one beats another."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nav_adapter import AwarenessPolicy
from sim_tests import SimError
from sim_tests.conditions import Experiment
from sim_tests.crossing import named_policy
from sim_tests.scenario import Scenario, shipped_scenarios
from sim_tests.search._settings import common_settings
from sim_tests.search._study import Outcome, Trial
from sim_tests.search.tune._evaluation import (
    BEATS_BASE,
    Candidate,
    Evaluation,
    beats,
    dropped,
    level_of,
    merged,
    named_winner,
    stages,
)
from sim_tests.search.tune._policy_space import PolicySpace, read_ranges, shipped_ranges
from sim_tests.search.tune._tune import TuneSettings, Tuning, held_out_scenarios, ranked_trials
from sim_tests.search.tune._verdict import change_text, is_undecided, verdict_text
from sim_tests.study.measures import EpisodeRecord, Interval

PRESETS = ("blind", "conservative", "balanced", "assertive")
SPACES = {name: PolicySpace(AwarenessPolicy.preset(name)) for name in PRESETS}
TASKS = [(scenario, seed) for scenario in "abcdef" for seed in range(5)]


@given(
    name=st.sampled_from(PRESETS),
    share=st.fixed_dictionaries({name: st.floats(0.0, 1.0) for name in shipped_ranges()}),
)
def test_every_point_of_the_space_is_a_policy_that_keeps_the_floor(name, share):
    ranges = SPACES[name].ranges
    policy = SPACES[name].policy(
        {n: (1.0 - share[n]) * r.low + share[n] * r.high for n, r in ranges.items()}
    )
    for alpha in (0.0, 0.3, 0.6, 1.0):
        assert policy.inflation.radius_m(alpha) >= 0.40
        assert policy.speed.human_speed_mps(alpha) >= policy.speed.human_speed_mps(1.0)
    assert policy.speed.human_speed_mps(0.0) >= 1.05
    assert policy.margins.clearance_m >= 0.10
    assert AwarenessPolicy.model_validate(policy.model_dump(mode="json")) == policy


@pytest.mark.parametrize(
    ("base", "part", "searched_with"),
    [
        (AwarenessPolicy.preset("blind"), "attention", "reach"),
        (named_policy("scanner")[1], "reach", "timing"),
        (AwarenessPolicy(without=["reach"]), "attention", "filter"),
    ],
)
def test_a_part_that_is_turned_off_is_not_searched_and_stays_off(base, part, searched_with):
    space = PolicySpace(base)
    starts = {name.partition(".")[0] for name in space.ranges}
    assert part not in starts
    assert searched_with in starts
    policy = space.policy(space.base_parameters())
    assert getattr(policy, part) is None or part in policy.without
    with pytest.raises(SimError, match="turned off every part"):
        PolicySpace(base, {n: r for n, r in shipped_ranges().items() if n.startswith(part)})


def test_a_parameter_sets_its_key_and_the_others_that_it_names_and_the_rest_is_the_base():
    space = SPACES["balanced"]
    assert space.policy(space.base_parameters()) == AwarenessPolicy.preset("balanced")
    changes = {"timing.hold_s": 1.5, "speed.aware_above": 0.77}
    policy = space.policy({**space.base_parameters(), **changes})
    assert policy.timing.hold_s == 1.5
    assert policy.inflation.aware_above == policy.speed.aware_above == 0.77


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("inflation.aware_radius_m: {low: 0.2, high: 0.8}", "not be searched below 0.4"),
        ("speed.unaware_human_speed_mps: {low: 1.0, high: 1.8}", "not be searched below 1.05"),
        ("margins.clearance_m: {low: 0.05, high: 0.8}", "not be searched below 0.1"),
        (
            "inflation.unaware_radius_m: {low: 0.5, high: 1.0, also: [inflation.aware_radius_m]}\n"
            "inflation.aware_radius: {low: 0.4, high: 0.8}",
            "no number 'inflation.aware_radius'; did you mean 'inflation.aware_radius_m'",
        ),
        ("alerts: {low: 0.4, high: 0.8}", "no number 'alerts'"),
        ("timing.hold_s: {low: 5.0, high: 50.0}", "policy that cannot be"),
        ("", "must hold places"),
        ("timing.hold_s: [1, 2", "not valid YAML"),
        ("timing.hold_s: {low: 2.0, high: 1.0}", "high must exceed low"),
        ("timing.hold_s: {low: 2.0, hihg: 3.0}", "did you mean 'high'"),
    ],
)
def test_unusable_ranges_are_refused_with_a_reason(tmp_path, text, message):
    path = tmp_path / "ranges.yaml"
    path.write_text(text)
    with pytest.raises(SimError, match=message):
        PolicySpace(AwarenessPolicy.preset("balanced"), read_ranges(path))


def test_trials_with_a_contact_above_the_risk_or_dropped_have_no_rank():
    rows = [(3.0, 0.0, -0.1), (1.0, 1.0, -0.1), (2.0, 0.0, -0.1), (1.0, 0.0, 0.1)]
    trials = [
        Trial(number, {}, Outcome(time_s, {"moving_contacts": contacts, "over_risk": over}))
        for number, (time_s, contacts, over) in enumerate(rows)
    ]
    trials += [Trial(4, {}, Outcome(1.0, notes={"dropped": "loses"})), Trial(5, {}, Outcome(None))]
    trials += [Trial(6, {}, Outcome(2.5, {"over_risk": 0.0}))]
    assert [trial.number for trial in ranked_trials(trials)] == [2, 6, 0]


def evaluation(time_s=5.0, risk=0.0, *, tasks=TASKS, contacts=0, spread=0.3, name="p", requests=0):
    """Episodes of which each scenario and seed has the same chance part in every policy."""
    records = []
    for row, (scenario, seed) in enumerate(tasks):
        chance = np.random.default_rng([ord(scenario), seed]).normal()
        own = np.random.default_rng([ord(scenario), seed, round(100 * time_s)]).normal()
        records.append(
            EpisodeRecord(
                *(scenario, seed, name, "q", "truth"),
                time_lost_s=time_s + 2.0 * chance + spread * own,
                step_out_not_looking=risk,
                moving_contacts=int(row < contacts),
                requests=requests,
            )
        )
    return Evaluation.of(records)


def test_an_evaluation_counts_contacts_and_errors_and_means():
    walked_into = {"contact": True, "contact_by": "person", "moving_contacts": 1}
    rows = [
        (2, {"time_lost_s": 3.0, "step_out_not_looking": 0.5, "person_contacts": 1, **walked_into}),
        (0, {"error": "no"}),
        (1, {"time_lost_s": 1.0, "step_out_not_looking": 0.0, "time_to_goal_s": 9.0}),
    ]
    records = [EpisodeRecord("s", seed, "p", "q", "truth", **values) for seed, values in rows]
    found = Evaluation.of(records)
    assert found.figures == (2.0, 0.25)
    # A person who walked into the moving robot counts, too.
    assert (found.risk, found.moving_contacts, found.reached) == (0.25, 1, 1)
    assert found.errors == ("no",)
    assert found.minus(found, "time_lost_s").value == 0.0


@given(st.integers(1, 200), st.integers(0, 10**6))
def test_stages_are_the_seeds_in_order_and_double_what_has_run(count, first):
    seeds = range(first, first + count)
    parts = list(stages(seeds))
    assert list(itertools.chain(*parts)) == list(seeds)
    done = list(itertools.accumulate(map(len, parts)))
    assert all(after == min(2 * before, count) for before, after in itertools.pairwise(done))
    # More seeds keep the earlier parts, so that their episodes serve again.
    assert list(stages(range(first, first + 2 * count)))[: len(parts) - 1] == parts[:-1]


@pytest.mark.parametrize(
    ("trial", "base_risk", "reason"),
    [
        ({"time_s": 6.5}, 0.0, "loses"),
        ({"time_s": 3.5}, 0.0, ""),
        ({"time_s": 5.01}, 0.0, ""),
        # Too few pairs show nothing, a contact is enough.
        ({"time_s": 6.5, "tasks": TASKS[:6]}, 0.0, ""),
        ({"time_s": 3.5, "risk": 0.7, "tasks": TASKS[:6]}, 0.0, ""),
        ({"time_s": 3.5, "contacts": 1, "tasks": TASKS[:6]}, 0.0, "contact"),
        # Above the risk it ends however fast it is.
        ({"time_s": 3.5, "risk": 0.6}, 0.0, "risk"),
        ({"time_s": 3.5, "risk": 0.5}, 0.0, ""),
        # A slower one within the risk goes on if the base policy is above it.
        ({"time_s": 6.5, "risk": 0.4}, 0.6, ""),
    ],
)
def test_a_trial_ends_when_it_is_shown_to_lose_or_to_be_above_the_risk(trial, base_risk, reason):
    assert dropped(evaluation(**trial), evaluation(risk=base_risk), 0.5) == reason


def test_the_estimate_from_few_episodes_uses_the_base_policy_on_the_same():
    base, whole = evaluation(), evaluation(6.0)
    assert whole.estimate(base) == whole.figures
    rng = np.random.default_rng(0)
    errors_s = []
    for _ in range(50):
        rows = rng.choice(len(TASKS), 8, replace=False)
        part = evaluation(6.0, tasks=[TASKS[row] for row in rows])
        errors_s.append([part.estimate(base)[0], part.figures[0]])
    paired_s, plain_s = np.std(np.array(errors_s) - whole.figures[0], axis=0)
    assert paired_s < 0.3 * plain_s


def test_a_third_of_the_scenarios_is_held_out_of_every_kind_of_attention():
    scenarios = [*map(Scenario.shipped, shipped_scenarios())]
    held_out = held_out_scenarios(scenarios)
    assert held_out == held_out_scenarios(scenarios[::-1])
    assert abs(len(held_out) - len(scenarios) / 3) < 1
    kinds = {each.attention for each in scenarios if each.name in held_out}
    assert kinds == {"attentive", "mixed", "unaware"}
    assert held_out_scenarios(scenarios[:2]) == ()


def tune_settings(**changes) -> TuneSettings:
    common = common_settings(Experiment({"scenario": ("runs_out",)}))
    others = {
        "episodes": 5,
        "ranges": {},
        "trials": 10,
        "held_out": 5,
        "sampler": "tpe",
        "generation": 4,
    }
    return TuneSettings(**{**common, "perception": "truth", **others, **changes})


@pytest.mark.parametrize("name", ["truth", "pixels+scanner", "scanner"])
def test_the_episodes_of_a_tuning_have_its_perception(name):
    balanced = AwarenessPolicy.preset("balanced")
    settings = tune_settings(perception=name)
    jobs = settings.jobs(
        "b", balanced, range(7, 9), [*map(Scenario.shipped, shipped_scenarios()[:3])]
    )
    assert len(jobs) == 6
    assert {(job.perception, job.policy) for job in jobs} == {(name, "b")}
    assert sorted({job.seed for job in jobs}) == [7, 8]


@given(seed=st.integers(0, 10**6), episodes=st.integers(1, 10**6), held_out=st.integers(1, 10**6))
def test_held_out_seeds_differ_from_tuning_seeds(seed, episodes, held_out):
    settings = dataclasses.replace(SETTINGS, seed=seed, episodes=episodes, held_out=held_out)
    tuning, held = settings.tuning_seeds, settings.held_out_seeds
    assert (len(tuning), len(held)) == (episodes, held_out)
    assert tuning.stop <= held.start


SETTINGS = tune_settings()


def candidate(name: str, number: int | None = 1, **values) -> Candidate:
    held_out = values.pop("held_out", None) or evaluation(**values)
    policy = AwarenessPolicy.preset("balanced")
    if number is not None:
        timing = policy.timing.model_copy(update={"hold_s": 1.0 + 0.01 * number})
        policy = policy.model_copy(update={"timing": timing})
    return Candidate((name,), number, policy, evaluation(values.get("time_s", 5.0)), held_out)


@pytest.mark.parametrize(
    ("values", "base", "requests", "wins"),
    [
        ({"time_s": 4.0}, {}, None, True),
        ({"time_s": 4.99}, {}, None, False),
        ({"time_s": 6.0}, {}, None, False),
        ({"time_s": 4.0, "tasks": TASKS[:15]}, {}, None, False),
        ({"time_s": 4.0, "contacts": 1}, {}, None, False),
        ({"time_s": 4.0, "risk": 0.6}, {}, None, False),
        # Within the risk, a slower policy beats one above it.
        ({"time_s": 6.0, "risk": 0.4}, {"risk": 0.6}, None, True),
        ({"time_s": 4.0, "risk": 0.55}, {"risk": 0.6}, None, False),
        # One that asks too often beats nobody; one that asks less beats one that asks too often.
        ({"time_s": 4.0, "requests": 2}, {}, None, True),
        ({"time_s": 4.0, "requests": 2}, {}, 2.0, True),
        ({"time_s": 4.0, "requests": 2}, {}, 1.9, False),
        ({"time_s": 6.0, "requests": 1}, {"requests": 3}, None, False),
        ({"time_s": 6.0, "requests": 1}, {"requests": 3}, 1.0, True),
    ],
)
def test_a_policy_beats_another_only_when_the_held_out_episodes_say_so(
    values, base, requests, wins
):
    other = candidate("base", None, **base)
    assert beats(candidate("mine", **values), other, 0.5, (), 0.95, requests) == wins


def test_a_gain_must_hold_in_the_held_out_scenarios():
    base = candidate("base", None)
    parts = [evaluation(3.0, tasks=TASKS[:20]), evaluation(6.0, tasks=TASKS[20:])]
    mixed = candidate("mixed", held_out=Evaluation.joined(parts))
    wins = [beats(mixed, base, 0.5, elsewhere, 0.95) for elsewhere in ("", "ab", "ef")]
    assert wins == [True, True, False]


def test_the_winner_gets_the_name_and_more_finalists_need_a_wider_interval():
    base = candidate("base", None)
    rows = [candidate("second", 1, time_s=4.2), candidate("other", 2, time_s=4.0)]
    names = [each.names for each in named_winner(rows, base, 0.5, ())]
    assert names == [("second",), (BEATS_BASE, "other")]
    assert [each.names for each in named_winner(rows[:0], base, 0.5, ())] == []
    (worse,) = named_winner([candidate("second", 1, time_s=5.5)], base, 0.5, ())
    assert worse.names == ("second",)
    assert [level_of(1), level_of(4)] == [0.95, pytest.approx(0.9875)]


def test_equal_policies_and_equal_episodes_are_one_row():
    base, same_policy = candidate("base", None), candidate("second", None)
    other = candidate("least_time_lost", 4, time_s=4.0)
    rows = merged([base, other, same_policy, candidate("third", 3)])
    assert [each.names for each in rows] == [("base", "second", "third"), ("least_time_lost",)]
    assert rows[0].trial is None


def tuning_of(*chosen: Candidate, hold_out=("e", "f"), requests=None) -> Tuning:
    settings = dataclasses.replace(SETTINGS, hold_out_scenarios=hold_out, requests=requests)
    base = candidate("balanced", None)
    rows = tuple(named_winner(chosen, base, 0.5, hold_out, requests))
    ranked = (Trial(0, {}, Outcome(1.0)),)
    return Tuning(settings, {}, (), ranked, (base,), rows, 0.5, 0.5)


def test_the_verdict_names_a_winner_with_its_intervals_and_says_that_it_was_not_falsified():
    tuning = tuning_of(candidate("second", 7, time_s=4.0))
    text = verdict_text(tuning)
    assert text.startswith("beats_base (trial 7, second) is better than balanced. On 30 held-out ")
    alone = tuning.winner.held_out.within("ef").minus(tuning.base.held_out, "time_lost_s")
    for words in (
        f"in the 2 held-out scenarios alone it loses {-alone.value:.2f} s less",
        "(95 % intervals)",
        "It has 0.00 step-out impacts per 1 000 crossings, balanced 0.00; 0.50 are allowed.",
        "The moving robot touched nobody (at most 9.5 % with 95 % confidence).",
    ):
        assert words in text
    assert text.endswith("It has not been falsified yet.")
    alone = verdict_text(tuning_of(candidate("second", 7, time_s=4.0), hold_out=()))
    assert "no scenario was held out" in alone


def test_the_verdict_names_a_preset_that_loses_less_than_the_base_policy():
    tuning = tuning_of(candidate("second", 7, time_s=6.0))
    faster = candidate("assertive", None, time_s=4.0)
    text = verdict_text(dataclasses.replace(tuning, anchors=(*tuning.anchors, faster)))
    assert text.startswith("keep balanced. ")
    assert "assertive loses 0.84 s less" in text
    assert "Of the presets" not in verdict_text(tuning)


@pytest.mark.parametrize(
    ("values", "reason", "undecided"),
    [
        ({"time_s": 4.88}, "a difference is not shown", True),
        ({"time_s": 6.0}, "it is shown to lose more time", False),
        ({"time_s": 4.0, "contacts": 2}, "the moving robot and a person touched", False),
        ({"time_s": 4.0, "risk": 0.7}, "it is above the risk", False),
        ({"time_s": 4.0, "requests": 2}, "it asks for attention too often", False),
        ({"time_s": 4.0, "tasks": TASKS[:15]}, "fewer than 20 pairs", True),
    ],
)
def test_the_verdict_keeps_the_base_policy_and_says_why(values, reason, undecided):
    tuning = tuning_of(candidate("second", 7, **values), requests=1.5)
    text = verdict_text(tuning)
    assert text.startswith(f"keep balanced. The nearest is second (trial 7): {reason}")
    assert is_undecided(tuning) == undecided


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ((-0.31, -0.5, -0.1), "loses 0.31 s less (-0.50 to -0.10 s)"),
        ((0.2, -0.5, 0.9), "loses 0.20 s more (-0.50 to +0.90 s)"),
        ((0.001, -0.01, 0.01), "loses neither less nor more (-0.01 to +0.01 s)"),
        ((0.5, -np.inf, np.inf), "loses 0.50 s more (too few pairs for an interval)"),
    ],
)
def test_a_difference_is_said_in_words(change, words):
    assert change_text(Interval(*change, 80)) == words
