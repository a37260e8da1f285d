"""Measures the steps per second of awarenav/Crossing-v0 against PyBullet alone.

    python -m benchmarks.crossing_steps [--steps 300]

Prints a Markdown table. Times are processor time of one process, with ``perception="truth"``. The
peer is the same stage whose physics runs for as long, without people that move, senses or adapter.
The ratio of the two changes little with the computer and its load.
"""

from __future__ import annotations

import time

import gymnasium
import numpy as np

from benchmarks._harness import count, make_parser
from sim_tests.learning import CrossingEnv

SCENARIOS = ("crossing_from_left", "blind_corner", "two_people_one_aware", "crowd_of_eight")
# Slow enough for the robot not to arrive within the measured steps.
_ACTION = np.array([0.2, 0.0])


def main() -> int:
    """Measure and print."""
    parser = make_parser(
        "benchmarks.crossing_steps",
        "Measure the steps per second of the Gymnasium environment against PyBullet alone.",
    )
    parser.add_argument(
        "--steps", type=count, default=300, metavar="N", help="steps per scenario (default: 300)"
    )
    steps = parser.parse_args().steps
    env = gymnasium.make("awarenav/Crossing-v0").unwrapped
    assert isinstance(env, CrossingEnv)
    print("| scenario | people | reset, ms | steps per CPU s | PyBullet alone | ratio |")
    print("| --- | --- | --- | --- | --- | --- |")
    env.reset(seed=0)
    for scenario in SCENARIOS:
        begun = time.process_time()
        env.reset(seed=0, options={"scenario": scenario})
        reset_s = time.process_time() - begun
        step_s = _seconds_per_step(env, steps)
        physics_s = _seconds_of_physics(env, steps)
        people = len(env.situation.truth)
        print(
            f"| `{scenario}` | {people} | {1e3 * reset_s:.0f} | {1.0 / step_s:.0f} | "
            f"{1.0 / physics_s:.0f} | {step_s / physics_s:.1f} |",
            flush=True,
        )
    env.close()
    return 0


def _seconds_per_step(env: CrossingEnv, steps: int) -> float:
    done = 0
    begun = time.process_time()
    while done < steps:
        _, _, terminated, truncated, _ = env.step(_ACTION)
        done += 1
        if terminated or truncated:
            break
    return (time.process_time() - begun) / done


def _seconds_of_physics(env: CrossingEnv, steps: int) -> float:
    """Return the time of the physics of a step, in a fresh episode of the same scenario."""
    env.reset(seed=0, options={"scenario": env.crossing.scenario.name})
    warehouse = env.crossing.stage.warehouse
    each = round(env.crossing.dt_s / warehouse.physics_dt_s)
    begun = time.process_time()
    for _ in range(steps * each):
        warehouse.step()
    return (time.process_time() - begun) / steps


if __name__ == "__main__":
    raise SystemExit(main())
