"""Command ``python -m benchmarks.asking``: the table of requests and their answers."""

from __future__ import annotations

import argparse
from typing import Final

import numpy as np

from sim_tests.crossing import run_crossing
from sim_tests.scenario import ScenarioTemplate

from ._looks import AskedPerson, asked_people

#: A look that is measured later than this came too late for its request.
SOON_S: Final = 1.0
# Scenarios with people who limit the robot and do not look by themselves.
_SCENARIOS: Final = (
    *("robot_overtaking", "busy_in_aisle", "stops_midway", "turns_back", "reads_phone"),
    *("crowd_of_eight", "two_people_one_aware", "crossing_distracted"),
)


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
