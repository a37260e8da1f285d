"""The last lines of ``awarenav tune`` and ``awarenav falsify``: a verdict, and the next command."""

from __future__ import annotations

import shlex
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from nav_adapter import AwarenessPolicy
from sim_tests.search._verdict import change_text, command_text, episode_words, is_shown, listed
from sim_tests.search.falsify._falsify import Falsification, FalsifySettings
from sim_tests.search.falsify._restarted_search import EvaluatedTrial
from sim_tests.search.falsify._verdict import policy_against, verdict_text
from sim_tests.search.falsify._worst_cases import WorstCase
from sim_tests.study.measures import EpisodeRecord, Interval
from sim_tests.study.runs import policy_text

_SETTINGS = FalsifySettings(
    *("mine", policy_text(AwarenessPolicy.preset("assertive")), (), 4, 2, "truth", "", 0, 4)
)


@dataclass
class _Options:
    scenario: tuple[str, ...] = ("all",)
    perception: str = "keypoints"
    sensors: str = "camera+scanner"
    camera: str = ""
    robot: str = ""
    population: str | None = None
    planner: str = ""


def _found(*scores: float) -> Falsification:
    trials = tuple(EvaluatedTrial("s", 0, row, {}, each, {}) for row, each in enumerate(scores))
    return Falsification(_SETTINGS, {}, trials)


def _record(policy: str, margin_m: float, contacts: int = 0) -> EpisodeRecord:
    return EpisodeRecord(
        *("s", 0, policy, "q", "truth"), min_margin_unaware_m=margin_m, moving_contacts=contacts
    )


def _cases(*records: EpisodeRecord) -> list[WorstCase]:
    return [
        WorstCase(None, Path(f"worst_{row:03d}.yaml"), None, None, record)
        for row, record in enumerate(records, start=1)
    ]


def test_a_falsified_policy_is_compared_in_the_same_situations():
    cases = _cases(_record("mine", -1.2, 1), _record("mine", -0.4), _record("mine", -0.1))
    others = {
        "worst_001.yaml": _record("balanced", -0.3),
        "worst_002.yaml": _record("balanced", -0.5),
        "worst_003.yaml": _record("balanced", -0.1),
    }
    text = verdict_text(_found(-10.4, -0.4, 0.2), cases, others)
    assert text.startswith(
        "mine is not safe enough: the moving robot and a person who had not looked touched in 1 of "
        "3 episodes, at up to 0.40 m/s. Nobody who had looked was touched by the moving robot "
    )
    assert "balanced touches a person while it moves in 0 (mine in 1)" in text
    assert "keeps more margin in 1 and less in 1" in text
    assert "falls to -0.50 m at worst (mine to -1.20 m)" in text
    quiet = verdict_text(_found(-0.4, 0.2), [], {})
    assert quiet == (
        "no contact of the moving robot and a person who had not looked with mine in 2 episodes. A "
        "search is not a sample, so this gives no rate. Nobody who had looked was touched by the "
        "moving robot either."
    )


def test_contacts_with_people_who_had_looked_are_told_apart():
    found = _found(-0.4, -0.3, -10.7, 0.2)
    contacts = [(1, 0, 0.9), (0, 0, None), (2, 1, 1.1), (1, 1, 0.2)]
    trials = tuple(
        replace(
            trial,
            notes={
                "moving_contacts": moving,
                "moving_contacts_unaware": unaware,
                "moving_contact_mps": speed_mps,
            },
        )
        for trial, (moving, unaware, speed_mps) in zip(found.trials, contacts, strict=True)
    )
    found = replace(found, trials=trials)
    assert (found.contacts, found.aware_contacts) == (1, 2)
    assert found.contact_mps == pytest.approx(0.7)
    assert found.aware_contact_mps == 1.1
    text = verdict_text(found, [], {})
    assert "touched in 1 of 4 episodes, at up to 0.70 m/s." in text
    assert "who had looked within 1 s in 2 (50.0 %), at up to 1.10 m/s" in text
    assert "--policy scanner" in text
    # Nobody who had not looked was touched, and the search found no case against it.
    only_aware = replace(found, trials=trials[:2])
    assert verdict_text(only_aware, [], {}).startswith(
        "no contact of the moving robot and a person"
    )


def test_a_failed_episode_of_the_other_policy_is_not_compared():
    failed = replace(_record("balanced", 0.5), error="died")
    text = verdict_text(_found(-0.4), _cases(_record("mine", -0.4)), {"worst_001.yaml": failed})
    assert "balanced" not in text


@pytest.mark.parametrize(
    ("given", "policy", "expected"),
    [
        ("", "assertive", "balanced"),
        ("", "balanced", "blind"),
        ("conservative", "balanced", "conservative"),
    ],
)
def test_a_policy_is_compared_with_another_one(given, policy, expected):
    settings = replace(_SETTINGS, policy=policy_text(AwarenessPolicy.preset(policy)))
    name, text = policy_against(given, settings)
    assert name == expected
    assert text == policy_text(AwarenessPolicy.preset(expected))
    assert policy_against(given, replace(settings, unsafe_no_floor=True)) is None


def test_changes_are_words_and_shown_only_by_enough_pairs():
    change = Interval(-0.31, -0.5, -0.1, 80)
    assert change_text(change, 2, "loses") == "loses 0.31 s less (-0.50 to -0.10 s)"
    assert change_text(replace(change, value=0.2), 1, "loses").startswith("loses 0.2 s more")
    same = change_text(Interval(0.0, -0.01, 0.01, 80), 2, "loses")
    assert same == "loses neither less nor more (-0.01 to +0.01 s)"
    assert is_shown(change)
    assert not is_shown(replace(change, n=19))
    assert not is_shown(replace(change, high=0.1))
    assert listed(["a", "b", "c"]) == "a, b and c"


def test_the_next_command_repeats_the_sensors_and_is_safe_for_a_shell():
    words = episode_words(_Options(scenario=("my file.yaml", "runs_out"), planner="a.b:C"))
    command = command_text("falsify", *words)
    assert shlex.split(command) == ["awarenav", "falsify", *words]
    assert words[:3] == ["--scenario", "my file.yaml", "runs_out"]
    assert words[3:] == [
        *("--perception", "keypoints", "--sensors", "camera+scanner", "--planner", "a.b:C")
    ]
    assert "--camera" not in words
    others = episode_words(_Options(population="recorded", robot="my robot.yaml"))
    assert others[-4:] == ["--robot", "my robot.yaml", "--population", "recorded"]
