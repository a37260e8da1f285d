"""Measures what a control cycle costs: ``python -m benchmarks.adapter``.

It times `NavAdapter.update`, `circles` and a costmap of 200 × 200 cells of 5 cm, with 20, 100 and
500 people who all walk about on that map. It gives the processor time of one thread: the least over
the repeats for each frame, and the median over the frames. On one of two cores of a busy x86-64
server, in milliseconds:

| people | update | circles | costmap | cycle | painter |
| --- | --- | --- | --- | --- | --- |
| 20 | 1.2 | 0.01 | 0.66 | 1.9 | 0.44 |
| 100 | 3.1 | 0.06 | 2.3 | 5.5 | 1.4 |
| 500 | 15.5 | 0.28 | 10.3 | 26.2 | 6.0 |

It also times `speed_limit_at` for 1 000 trajectories of 30 poses with 10 people (47 ms, with
headings 87 ms, with speeds and yaw rates too 96 ms; `NavAdapter.update` pose by pose would take
22.6 s) and `SpeedMap` for 200 × 200 cells (43 ms).

The exit status is 1 when a cycle with 20 people takes more than 2 ms, when one more person costs
half as much again in a large crowd, or when a figure is worse than the baseline allows.
"""

from __future__ import annotations

import gc
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Final, TypeVar

import numpy as np
from tqdm import tqdm

from awarenav.baseline import MeasuredValue
from nav_adapter import (
    AwarenessPolicy,
    NavAdapter,
    NavConstraints,
    RobotProfile,
    RobotState,
    circles,
    paint_costmap,
)
from nav_adapter.exporters import CostmapPainter, SpeedMap, speed_limit_at
from tracking import PersonTrack

from ._harness import add_seed, count, finish, make_parser, parse

BASELINE: Final = Path(__file__).with_name("adapter_baseline.json")
#: Most processor time of a cycle with 20 people, milliseconds.
MAX_CYCLE_MS: Final = 2.0
#: Most cost of one more person in the largest crowd, relative to the step between the smaller two.
MAX_GROWTH: Final = 1.5
PEOPLE: Final = (20, 100, 500)
#: Steps whose sum is a cycle. The painter is an alternative to "costmap".
CYCLE: Final = ("update", "circles", "costmap")
#: Sampled trajectories and times of the speed field, and its people.
TRAJECTORIES, TIMES, FIELD_PEOPLE = 1000, 30, 10
_FIELD_FRAMES: Final = 20
# Updates that are timed; all 30 000 would take many seconds.
_UPDATES: Final = 200

_SIDE_M: Final = 10.0
_ORIGIN_ODOM_M: Final = (-0.5 * _SIDE_M, -0.5 * _SIDE_M)
_RESOLUTION_M: Final = 0.05
_CELLS: Final = (200, 200)
_DT_S: Final = 0.05
_ROBOT: Final = RobotProfile(
    footprint_m=np.array([[0.36, 0.25], [-0.36, 0.25], [-0.36, -0.25], [0.36, -0.25]]),
    max_speed_mps=1.5,
    max_acceleration_mps2=1.0,
    max_deceleration_mps2=1.0,
    reaction_time_s=0.3,
)
_Result = TypeVar("_Result")


def crowd(people: int, frames: int, rng: np.random.Generator) -> list[tuple[PersonTrack, ...]]:
    """Return the tracks of every frame: all people walk, half of them are aware.

    A person who leaves one side of the map comes back on the other.
    """
    start = rng.uniform(-0.45 * _SIDE_M, 0.45 * _SIDE_M, (people, 2))
    direction = rng.uniform(-np.pi, np.pi, people)
    velocity = 0.7 * np.stack([np.cos(direction), np.sin(direction)], axis=1)
    lower = np.where(rng.random(people) < 0.5, 0.8, 0.0)
    covariance = np.diag([0.01, 0.01, 0.04, 0.04])
    half = 0.5 * _SIDE_M
    return [
        tuple(
            PersonTrack(
                id=index,
                stamp_s=frame * _DT_S,
                status="confirmed",
                position_odom_m=(start[index] + frame * _DT_S * velocity[index] + half) % _SIDE_M
                - half,
                velocity_odom_mps=velocity[index],
                covariance_odom=covariance,
                awareness=float(lower[index]),
                awareness_std=0.1,
                awareness_lower=float(lower[index]),
                height_m=1.75,
                time_since_seen_s=0.0,
            )
            for index in range(people)
        )
        for frame in range(frames)
    ]


def _robot_at(stamp_s: float) -> RobotState:
    """Return a robot in the middle of the map that drives at 0.5 m/s."""
    return RobotState(stamp_s, np.zeros(2), 0.0, 0.5, 0.0)


def cost_ms(people: int, frames: int, repeats: int, seed: int) -> dict[str, float]:
    """Return the median processor milliseconds of each step over the frames.

    The least time of a frame over the repeats counts, since other programs can only slow it down.
    The first half second, in which every person is new, is left out.
    """
    tracks = crowd(people, frames, np.random.default_rng([seed, people]))
    least = {step: np.full(frames, np.inf) for step in (*CYCLE, "painter")}
    for _ in range(repeats):
        adapter = NavAdapter(AwarenessPolicy.preset("balanced"), _ROBOT)
        lasting = CostmapPainter(np.zeros(_CELLS, dtype=np.uint8), _ORIGIN_ODOM_M, _RESOLUTION_M)
        gc.collect()
        for frame, current in enumerate(tracks):
            now = frame * _DT_S
            fresh = np.zeros(_CELLS, dtype=np.uint8)

            def timed(step: str, work: Callable[[], _Result], frame: int = frame) -> _Result:
                began = time.thread_time()
                result = work()
                least[step][frame] = min(least[step][frame], time.thread_time() - began)
                return result

            update = partial(adapter.update, current, _robot_at(now), now)
            constraints = timed("update", update)
            timed("circles", partial(circles, constraints))
            paint = partial(paint_costmap, fresh, _ORIGIN_ODOM_M, _RESOLUTION_M, constraints)
            timed("costmap", paint)
            timed("painter", partial(lasting.update, constraints))
    settled = slice(min(round(0.5 / _DT_S), frames // 2), None)
    return {step: 1e3 * float(np.median(times[settled])) for step, times in least.items()}


def field_ms(repeats: int, seed: int) -> dict[str, float]:
    """Return the least processor milliseconds over the repeats.

    ``field`` is for positions alone, ``headed`` for headings too, ``driven`` for speeds and yaw
    rates too, ``map`` for 200 × 200 cells, and ``updates`` for as many calls of
    :meth:`NavAdapter.update` as the field has poses.
    """
    rng = np.random.default_rng([seed, FIELD_PEOPLE])
    adapter = NavAdapter(AwarenessPolicy.preset("balanced"), _ROBOT)
    tracks = crowd(FIELD_PEOPLE, _FIELD_FRAMES, rng)
    for frame, current in enumerate(tracks):
        now = frame * _DT_S
        constraints: NavConstraints = adapter.update(current, _robot_at(now), now)
    shape = TRAJECTORIES, TIMES
    positions = rng.uniform(-4.0, 4.0, (*shape, 2))
    headings, speeds = rng.uniform(-np.pi, np.pi, shape), rng.uniform(0.1, 1.5, shape)
    rates = rng.uniform(-1.0, 1.0, shape)
    poses = [
        RobotState(now, position, heading, speed, 0.0)
        for position, heading, speed in zip(
            positions[:_UPDATES, 0], headings[:_UPDATES, 0], speeds[:_UPDATES, 0], strict=True
        )
    ]
    field = partial(speed_limit_at, constraints, positions)
    work: dict[str, Callable[[], object]] = {
        "field": lambda: field(dt_s=0.1),
        "headed": lambda: field(headings, dt_s=0.1),
        "driven": lambda: field(headings, dt_s=0.1, speeds_mps=speeds, yaw_rates_radps=rates),
        "map": lambda: SpeedMap.around(
            constraints, [0.0, 0.0], size_m=_SIDE_M, resolution_m=_RESOLUTION_M
        ),
        "updates": lambda: [adapter.update(tracks[-1], pose, now) for pose in poses],
    }
    least = dict.fromkeys(work, np.inf)
    for name, each in work.items():
        for _ in range(repeats):
            began = time.thread_time()
            each()
            least[name] = min(least[name], 1e3 * (time.thread_time() - began))
    least["updates"] *= TRAJECTORIES * TIMES / len(poses)
    return least


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return 0 for success, 1 for a missed goal, 2 for bad input."""
    description = (__doc__ or "").partition("\n\n")[2].partition(". It gives")[0]
    parser = make_parser("benchmarks.adapter", f"{description}.", BASELINE)
    parser.add_argument("--frames", type=count, default=60, metavar="N", help="default: 60")
    parser.add_argument("--repeats", type=count, default=5, metavar="N", help="default: 5")
    add_seed(parser)
    options, baseline = parse(parser, arguments)

    costs: dict[int, dict[str, float]] = {}
    for people in tqdm(PEOPLE, unit="crowd", leave=False, file=sys.stderr):
        # Large crowds take longer and need fewer frames for the same certainty.
        frames = max(8, options.frames * PEOPLE[0] // people)
        cost = costs[people] = cost_ms(people, frames, options.repeats, options.seed)
        cost["cycle"] = sum(cost[step] for step in CYCLE)
    steps = (*CYCLE, "cycle", "painter")
    print(f"{'people':>8s}" + "".join(f"{step:>10s}" for step in steps) + "   ms of processor time")
    for people, cost in costs.items():
        print(f"{people:8d}" + "".join(f"{cost[step]:10.3f}" for step in steps))
    field = field_ms(options.repeats, options.seed)

    few, more, most = (costs[people]["cycle"] for people in PEOPLE)
    slopes = (more - few) / (PEOPLE[1] - PEOPLE[0]), (most - more) / (PEOPLE[2] - PEOPLE[1])
    growth = slopes[1] / slopes[0]
    # A bare time depends on the computer; the wide tolerance only catches a large change.
    metrics = [
        MeasuredValue("adapter_20_cycle", few, "ms", "lower", 1.0),
        MeasuredValue("adapter_a_person_more_500_over_100", growth, "x", "lower", 0.5),
        MeasuredValue("speed_field", field["field"], "ms", "lower", 1.0),
        MeasuredValue("speed_field_headed", field["headed"], "ms", "lower", 1.0),
        MeasuredValue("speed_field_driven", field["driven"], "ms", "lower", 1.0),
        MeasuredValue("speed_map", field["map"], "ms", "lower", 1.0),
        MeasuredValue(
            "speed_field_over_updates", field["field"] / field["updates"], "x", "lower", 0.5
        ),
    ]
    for metric in metrics:
        print(f"{metric.name:44s}{metric.value:9.3f} {metric.unit}")
    missed = [
        f"{what}: {found:.2f} {unit}, at most {most:g} wanted"
        for what, found, most, unit in (
            (f"a cycle with {PEOPLE[0]} people", few, MAX_CYCLE_MS, "ms"),
            ("one more person in a large crowd", growth, MAX_GROWTH, "times as much"),
        )
        if found > most
    ]
    return finish(metrics, missed, baseline, options.out)


if __name__ == "__main__":
    sys.exit(main())
