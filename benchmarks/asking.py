"""True looks after requests, and how soon they are measured: ``python -m benchmarks.asking``.

Each true look after a request for attention is compared with what the adapter made of it.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from typing import Final

import numpy as np

from perception.arrays import FloatArray
from sim_tests.crossing import CrossingFrame, CrossingResult, run_crossing
from sim_tests.scenario import ScenarioTemplate

#: A look that is measured later than this came too late for its request.
SOON_S: Final = 1.0
# Scenarios with people who limit the robot and do not look by themselves.
_SCENARIOS: Final = (
    *("robot_overtaking", "busy_in_aisle", "stops_midway", "turns_back", "reads_phone"),
    *("crowd_of_eight", "two_people_one_aware", "crossing_distracted"),
)
#: The lower bound of α from which a look counts as measured.
LOOKED: Final = 0.5
#: A look within this time after a request answers it.
ANSWERED_WITHIN_S: Final = 2.5
#: Whoever has looked within this time before it was not won by it.
LOOKED_BEFORE_S: Final = 0.5
#: Somebody is at the obstacle's place within this distance.
SAME_PLACE_M: Final = 1.0


@dataclass(frozen=True, slots=True)
class AskedPerson:
    """The outcome of one request.

    Attributes:
        look_s: time from the request to the true look; None without one.
        measured_s: time from the look, or from the request without one, to the first update whose
            lower bound of α counts as a look; None if there was none within 3.5 s of the request.
        counted_s: time for which it counted without a break.
    """

    look_s: float | None
    measured_s: float | None
    counted_s: float = 0.0


def asked_people(result: CrossingResult) -> list[AskedPerson]:
    """Return what came of every request whose person is known, and had not looked before."""
    frames = result.frames
    times_s = np.array([frame.t_s for frame in frames])
    found = []
    for frame in frames:
        for alert in frame.constraints.alerts:
            if alert.kind != "attention":
                continue
            place = _place_of(frame, alert.track_id)
            person = None if place is None else _person_at(frame, place)
            if person is not None:
                asked = _asked(frames, times_s - frame.t_s, person)
                if asked is not None:
                    found.append(asked)
    return found


def _asked(
    frames: tuple[CrossingFrame, ...], since_s: FloatArray, person: int
) -> AskedPerson | None:
    looks = np.array([frame.truth[person].since_look_s <= 0.0 for frame in frames])
    lowers = np.array([_lower_of(frame, person) for frame in frames])
    if looks[(since_s >= -LOOKED_BEFORE_S) & (since_s <= 0.0)].any():
        return None
    after = np.flatnonzero(looks & (since_s > 0.0) & (since_s <= ANSWERED_WITHIN_S))
    begin_s = float(since_s[after[0]]) if len(after) else 0.0
    # Somebody who looks later than an answer may be measured then, and rightly so.
    until_s = ANSWERED_WITHIN_S + 1.0 if len(after) else ANSWERED_WITHIN_S
    counted = (lowers >= LOOKED) & (since_s >= begin_s - 1e-9) & (since_s <= until_s)
    look_s = begin_s if len(after) else None
    if not counted.any():
        return AskedPerson(look_s, None)
    first = int(np.argmax(counted))
    ends = np.flatnonzero((lowers < LOOKED) & (since_s > since_s[first]))
    end_s = since_s[ends[0]] if len(ends) else since_s[-1]
    return AskedPerson(look_s, float(since_s[first]) - begin_s, float(end_s - since_s[first]))


def _place_of(frame: CrossingFrame, track_id: int) -> FloatArray | None:
    for obstacle in frame.constraints.obstacles:
        if obstacle.track_id == track_id:
            return obstacle.center_odom_m
    return None


def _person_at(frame: CrossingFrame, place_m: FloatArray) -> int | None:
    if not frame.truth:
        return None
    away_m = [float(np.hypot(*(view.position_odom_m - place_m))) for view in frame.truth]
    nearest = int(np.argmin(away_m))
    return nearest if away_m[nearest] <= SAME_PLACE_M else None


def _lower_of(frame: CrossingFrame, person: int) -> float:
    """Return the lower bound of α of the obstacle at a person's place; 0 for none."""
    place_m = frame.truth[person].position_odom_m
    near = [
        (float(np.hypot(*(each.center_odom_m - place_m))), each.awareness_lower)
        for each in frame.constraints.obstacles
    ]
    away_m, lower = min(near, default=(np.inf, 0.0))
    return lower if away_m <= SAME_PLACE_M else 0.0


def main() -> None:
    """Print how many true answers were measured, how soon, and how many looks were none."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.asking", description=main.__doc__)
    parser.add_argument("--perception", nargs="+", default=["keypoints+scanner", "truth"])
    parser.add_argument("--scenario", nargs="+", default=list(_SCENARIOS))
    parser.add_argument("--seeds", type=int, default=3, help="seeds per scenario (default 3)")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--population", default="answers=0.8", help="as for awarenav crossings")
    parser.add_argument("--policy", default="balanced")
    options = parser.parse_args()
    print(
        "| perception | requests | true answers | measured within 1 s | median delay | counts for"
    )
    print("| --- | --- | --- | --- | --- | ---")
    for perception in options.perception:
        people: list[AskedPerson] = []
        for name in options.scenario:
            template = ScenarioTemplate.named(name).with_population(options.population)
            for seed in range(options.first_seed, options.first_seed + options.seeds):
                result = run_crossing(
                    template.for_seed(seed),
                    policy=options.policy,
                    perception=perception,
                    seed=seed,
                )
                people += asked_people(result)
        print(_row(perception, people), flush=True)


def _row(perception: str, people: list[AskedPerson]) -> str:
    answers = [each for each in people if each.look_s is not None]
    others = [each for each in people if each.look_s is None]
    delays_s = [each.measured_s for each in answers if each.measured_s is not None]
    soon = sum(delay_s <= SOON_S + 1e-9 for delay_s in delays_s)
    counted_s = [each.counted_s for each in answers if each.measured_s is not None]
    false = sum(each.measured_s is not None for each in others)
    delay_s = float(np.median(delays_s)) if delays_s else float("nan")
    lasts_s = float(np.median(counted_s)) if counted_s else float("nan")
    return (
        f"| {perception} | {len(people)} | {len(answers)} | {soon} of {len(answers)} | "
        f"{delay_s:.2f} s | {lasts_s:.1f} s (false: {false} of {len(others)})"
    )


if __name__ == "__main__":
    main()
