"""People on the stage whom the robot asks for attention: they turn, look, or startle."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from staged_people import DT_S, StageRun, run_stage

from nav_adapter import Alert
from sim_tests import Scenario
from sim_tests.actors.behaviour import WALKER_RADIUS_M
from sim_tests.crossing import Crossing, Setup, Stage
from sim_tests.world.hall import WarehouseLayout

ANSWERS = {"answers": 1.0, "startles": 0.0, "delay_spread": 1.0, "look_spread": 1.0}
DEAF = {"answers": 0.0, "startles": 0.0}
# They walk away ahead of the robot, and never look by themselves.
WALKER = {
    "name": "p",
    "route": [{"x_m": 4.0, "y_m": 0.6}, {"x_m": 12.0, "y_m": 0.6}],
    "speed_mps": 1.0,
    "glances": {"notices_within_m": 0.0},
}
# They look ahead as planned.
PLANNED = {**WALKER, "gaze": [{"t_s": 0.0, "look": "ahead"}]}


def run(
    *,
    at_s: tuple[float, ...] = (2.0,),
    who: int = 0,
    seconds: float = 6.0,
    robot_mps: float = 0.4,
    people: list[dict[str, Any]] | None = None,
    **scenario: Any,
) -> StageRun:
    """Run a stage with a robot that drives straight ahead and asks one person."""
    return run_stage(
        people or [], seconds=seconds, robot_mps=robot_mps, asks_at_s=at_s, asks=who, **scenario
    )


def looks_s(asked: StageRun, person: int = 0) -> float:
    """Return how long the true awareness is at least 0.5."""
    return float((asked.awareness[:, person] >= 0.5).sum() * DT_S)


def noticed_s(asked: StageRun) -> tuple[float | None, ...]:
    return tuple(outcome.noticed_s for outcome in asked.outcomes)


def recorded_csv(folder: Path) -> dict[str, Any]:
    """Return the keys of a scenario that replays somebody who walks away ahead of the robot."""
    path = folder / "recorded.csv"
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["t_s", "id", "x_m", "y_m"])
        table.writerows([0.1 * n, "one", 4.0 + 0.1 * n, 0.6] for n in range(81))
    return {"replay_csv": str(path)}


KINDS = ("walker", "recorded walker", "planned gaze", "replayed", "displaced")


def of_kind(kind: str, folder: Path) -> dict[str, Any]:
    if kind == "planned gaze":
        return {"people": [PLANNED]}
    if kind in ("replayed", "displaced"):
        return {**recorded_csv(folder), "replay_reacts": kind == "displaced"}
    return {"people": [WALKER], "population": "recorded" if "recorded" in kind else "classic"}


@pytest.mark.parametrize("kind", KINDS)
def test_who_walks_away_turns_back_and_looks(kind: str, tmp_path: Path) -> None:
    """The true awareness rises after the delay, and falls again after the look."""
    people = of_kind(kind, tmp_path)
    asked = run(**people, hearing=ANSWERS, seconds=8.0)
    before = asked.times_s < 2.7
    assert asked.awareness[before].max() == 0.0
    assert asked.awareness.max() > 0.7
    assert 0.8 <= looks_s(asked) <= 1.6  # and turning to it and away takes time too
    met = asked.times_s[np.flatnonzero(asked.awareness[:, 0] >= 0.5)[0]]
    assert 3.0 <= met <= 4.0
    # Eyes, head and trunk turn at human speeds, and the feet walk on.
    headings = np.unwrap(asked.angles[:, 0, 0])
    turned = headings + asked.angles[:, 0, 1]
    assert np.abs(np.diff(turned)).max() / DT_S <= 3.2 + 2.6 + 0.2
    assert np.abs(np.diff(headings)).max() / DT_S <= 2.6 + 0.2
    silent = run(**people, hearing=ANSWERS, seconds=8.0, at_s=())
    if kind == "replayed":
        assert np.array_equal(asked.places, silent.places)
        assert asked.angles[-1] == pytest.approx(silent.angles[-1])
    assert silent.awareness.max() == 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_at_no_answers_asking_changes_nothing_at_all(kind: str, tmp_path: Path) -> None:
    people = of_kind(kind, tmp_path)
    silent = run(**people, at_s=())
    asked = run(**people, hearing=DEAF, at_s=(0.5, 2.0, 3.0))
    for name in ("places", "speeds", "angles", "awareness"):
        assert np.array_equal(getattr(silent, name), getattr(asked, name)), name


def test_who_has_forgotten_the_robot_looks_but_stays_lapsed() -> None:
    """The person crosses the robot's line: the look alone does not make them wait."""
    crosser = {
        "name": "p",
        "route": [{"x_m": 5.0, "y_m": -4.0}, {"x_m": 5.0, "y_m": 4.0}],
        "glances": {"watches": True, "first_glance_delay_s": 0.0},
        "reactions": {"wait": 1.0},
        "lapse": {"after_look_s": 0.2},
        "social": False,
    }
    asked = run(people=[crosser], hearing=ANSWERS, robot_mps=0.8, at_s=(1.0,))
    silent = run(people=[crosser], at_s=(), robot_mps=0.8)
    late = asked.times_s > 1.5
    assert asked.awareness[late].max() > 0.7 > silent.awareness[late].max()
    assert np.array_equal(asked.places, silent.places)


def test_nobody_looks_through_a_rack() -> None:
    """A voice is heard there; the look meets nothing, and the person does not notice the robot."""
    layout = WarehouseLayout.named("open").model_dump()
    rack = {"x_m": 2.8, "y_m": 0.0, "length_m": 1.0, "width_m": 3.0}
    hidden = {**layout, "racks": [*layout["racks"], rack]}
    stands = {**WALKER, "route": [{"x_m": 5.0, "y_m": 0.3}]}
    for person in (stands, {**stands, "gaze": [{"t_s": 0.0, "look": "ahead"}]}):
        people = {"people": [person]}
        seen = run(**people, hearing=ANSWERS, layout=layout, robot_mps=0.0)
        asked = run(**people, hearing=ANSWERS, layout=hidden, robot_mps=0.0)
        assert seen.awareness.max() > 0.7
        assert asked.awareness.max() == 0.0
        assert noticed_s(asked) == (None,)


@pytest.mark.parametrize(
    ("kind", "into"), [*((kind, 1.0) for kind in KINDS), ("walker", 0.0), ("replayed", 0.0)]
)
def test_a_startle_stays_within_the_speed_that_the_limit_counts_with(kind, into, tmp_path) -> None:
    """A person off the robot's line stops, steps aside, or steps towards it, and walks on."""
    people = of_kind(kind, tmp_path)
    jumpy = {**DEAF, "startles": 1.0, "startles_into_path": into, "delay_spread": 1.0}
    silent = run(**people, hearing=jumpy, at_s=(), seconds=9.0)
    ways = set()
    seeds = 4 if kind == "walker" and not into else 1
    for seed in range(seeds):
        asked = run(**people, hearing=jumpy, seconds=9.0, seed=seed)
        moved_mps = np.linalg.norm(np.diff(asked.places, axis=0), axis=2) / DT_S
        # People of a recording catch up with it at 1.6 m/s at most.
        most_mps = {"recorded walker": 1.7, "replayed": 1.61, "displaced": 1.61}.get(kind, 1.5)
        assert moved_mps.max() <= most_mps
        assert asked.speeds.max() <= most_mps
        y_m = asked.places[:, 0, 1]
        near = asked.times_s < 4.5
        if into:
            assert y_m[near].min() < 0.6 - 0.35
            assert y_m[near].min() > -0.35
        else:
            assert y_m.min() > 0.6 - 0.3
            ways.add("aside" if y_m[near].max() > 0.6 + 0.25 else "stop")
        behind = silent.places[90, 0, 0] - asked.places[90, 0, 0]
        assert 0.5 < behind < 2.2  # a second and a half of its way
        assert np.array_equal(silent.places[:53], run_start(asked, seed, silent, people, jumpy))
    assert seeds == 1 or len(ways) == 2


def run_start(asked: StageRun, seed: int, silent: StageRun, people: Any, jumpy: Any) -> np.ndarray:
    """Return the places up to the startle; of another seed those of its own silent run."""
    if seed == 0:
        return asked.places[:53]
    own = run(**people, hearing=jumpy, at_s=(), seconds=3.0, seed=seed)
    assert np.array_equal(asked.places[:53], own.places[:53])
    return silent.places[:53]


def test_a_step_never_leads_into_a_rack() -> None:
    """The step aside of people who walk 0.4 m beside a rack ends half a body's width before it."""
    rack_y_m = 1.6
    spots = [{"x_m": 2.0, "y_m": 1.2}, {"x_m": 6.0, "y_m": 1.2}]
    people = {"people": [{**WALKER, "route": spots}]}
    jumpy = {**DEAF, "startles": 1.0, "startles_into_path": 0.0, "delay_spread": 1.0}
    boxes = [
        shapely.box(*box) for box in WarehouseLayout.named("aisles").obstacle_boxes_odom.tolist()
    ]
    highest = []
    for seed in range(4):
        asked = run(**people, hearing=jumpy, layout="aisles", seed=seed, at_s=(0.5,))
        for place in asked.places[:, 0]:
            gap_m = min(box.distance(shapely.Point(place)) for box in boxes)
            assert gap_m > WALKER_RADIUS_M - 0.01
        highest.append(float(asked.places[:, 0, 1].max()))
    assert rack_y_m - WALKER_RADIUS_M - 0.05 < max(highest) <= rack_y_m - WALKER_RADIUS_M + 0.01


def test_the_nearest_person_is_addressed_and_others_are_bystanders() -> None:
    stands = {**WALKER, "route": [{"x_m": 5.0, "y_m": 0.6}]}
    beside = {**WALKER, "name": "q", "route": [{"x_m": 5.0, "y_m": 1.8}]}
    hearing = {**ANSWERS, "bystander_factor": 0.0}
    first = run(people=[stands, beside], hearing=hearing)
    assert [looks_s(first, person) > 0.5 for person in (0, 1)] == [True, False]
    second = run(people=[stands, beside], hearing=hearing, who=1)
    assert [looks_s(second, person) > 0.5 for person in (0, 1)] == [False, True]
    both = run(people=[stands, beside], hearing={**hearing, "bystander_factor": 1.0})
    assert [looks_s(both, person) > 0.5 for person in (0, 1)] == [True, True]


def test_a_crossing_lets_people_hear_its_requests_and_not_its_warnings(monkeypatch) -> None:
    scenario = Scenario.shipped("crossing_distracted").with_population("answers=1,startles=0")
    asked: list[tuple[str, tuple[float, ...]]] = []
    monkeypatch.setattr(
        Stage, "request", lambda _, means, place: asked.append((means, tuple(place)))
    )
    with Crossing(Setup.of(scenario, policy="balanced")) as crossing:
        update = crossing._adapter.update

        def with_alerts(*words: Any, **named: Any) -> Any:
            constraints = update(*words, **named)
            ids = [each.track_id for each in constraints.obstacles]
            warned = [Alert(each, "horn", 1.0, 0.0, "test") for each in ids]
            calls = [
                Alert(each, "attention", 1.0, 0.0, "test", means="light", wins_s=2.0)
                for each in ids
            ]
            return replace(constraints, alerts=(*warned, *calls))

        monkeypatch.setattr(crossing._adapter, "update", with_alerts)
        for _ in range(20):
            now = crossing.sense()
            crossing.advance()
    assert asked
    assert {means for means, _ in asked} == {"light"}
    near = now.truth[0].position_odom_m
    assert asked[-1][1] == pytest.approx(tuple(near), abs=0.5)
