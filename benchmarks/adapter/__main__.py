"""Command ``python -m benchmarks.adapter``: the cost of a control cycle and of the speed field."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from tqdm import tqdm

from awarenav.baseline import MeasuredValue

from .._harness import add_seed, count, finish, make_parser, parse
from ._cost import CYCLE, cost_ms
from ._field import PEOPLE as FIELD_PEOPLE
from ._field import TIMES, TRAJECTORIES, field_ms

BASELINE = Path(__file__).with_name("baseline.json")
#: Most processor time of a cycle with 20 people, milliseconds.
MAX_CYCLE_MS = 2.0
#: Most cost of one more person in the largest crowd, relative to the step between the smaller two.
MAX_GROWTH = 1.5
PEOPLE = (20, 100, 500)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return 0 for success, 1 for a missed goal, 2 for bad input."""
    parser = make_parser(
        "benchmarks.adapter",
        "Measure the processor time of a control cycle with 20, 100 and 500 people on a map of "
        "200 × 200 cells of 5 cm: NavAdapter.update, circles and the costmap. For comparison, "
        "measure the painter that also clears, and the same costmap painted naively with shapely. "
        "Then measure the speed field of 1000 × 30 poses with 10 people, the speed map of that "
        "map, and as many calls of NavAdapter.update.",
        BASELINE,
    )
    parser.add_argument("--frames", type=count, default=60, metavar="N", help="default: 60")
    parser.add_argument("--repeats", type=count, default=5, metavar="N", help="default: 5")
    add_seed(parser)
    options, baseline = parse(parser, arguments)

    costs: dict[int, dict[str, float]] = {}
    for people in tqdm(PEOPLE, unit="crowd", leave=False, file=sys.stderr):
        # Large crowds take longer and need fewer frames for the same certainty.
        frames = max(8, options.frames * PEOPLE[0] // people)
        naive = people == PEOPLE[0]  # with more people it takes seconds per frame
        costs[people] = cost_ms(people, frames, options.repeats, options.seed, naive)
    steps = (*CYCLE, "cycle", "painter", "naive")
    print(f"{'people':>8s}" + "".join(f"{step:>10s}" for step in steps) + "   ms of processor time")
    for people, cost in costs.items():
        cost["cycle"] = sum(cost[step] for step in CYCLE)
        print(
            f"{people:8d}"
            + "".join(f"{cost[step]:10.3f}" if step in cost else f"{'-':>10s}" for step in steps)
        )

    field = field_ms(options.repeats, options.seed)
    print(
        f"{TRAJECTORIES} × {TIMES} poses, {FIELD_PEOPLE} people: field {field['field']:.1f} ms, "
        f"with headings {field['headed']:.1f} ms, with speeds and yaw rates too "
        f"{field['driven']:.1f} ms, update pose by pose {field['updates']:.0f} ms; speed map of "
        f"200 × 200 cells {field['map']:.1f} ms"
    )

    metrics = _metrics(costs, field)
    for metric in metrics:
        print(f"{metric.name:44s}{metric.value:9.3f} {metric.unit}")
    return finish(metrics, _missed(costs, metrics), baseline, options.out)


def _metrics(costs: dict[int, dict[str, float]], field: dict[str, float]) -> list[MeasuredValue]:
    few, more, most = PEOPLE
    slope_ms = (costs[more]["cycle"] - costs[few]["cycle"]) / (more - few)
    steeper_ms = (costs[most]["cycle"] - costs[more]["cycle"]) / (most - more)
    return [
        # A bare time depends on the computer; the wide tolerance only catches a large change.
        MeasuredValue("adapter_20_cycle", costs[few]["cycle"], "ms", "lower", 1.0),
        MeasuredValue(
            "adapter_20_costmap_over_naive",
            costs[few]["costmap"] / costs[few]["naive"],
            "x",
            "lower",
            0.5,
        ),
        MeasuredValue(
            "adapter_a_person_more_500_over_100", steeper_ms / slope_ms, "x", "lower", 0.5
        ),
        MeasuredValue("speed_field", field["field"], "ms", "lower", 1.0),
        MeasuredValue("speed_field_driven", field["driven"], "ms", "lower", 1.0),
        MeasuredValue("speed_map", field["map"], "ms", "lower", 1.0),
        MeasuredValue(
            "speed_field_over_updates", field["field"] / field["updates"], "x", "lower", 0.5
        ),
    ]


def _missed(costs: dict[int, dict[str, float]], metrics: list[MeasuredValue]) -> list[str]:
    missed = []
    cycle_ms = costs[PEOPLE[0]]["cycle"]
    if cycle_ms > MAX_CYCLE_MS:
        missed.append(
            f"a cycle with {PEOPLE[0]} people: {cycle_ms:.2f} ms, at most {MAX_CYCLE_MS:g} wanted"
        )
    growth = next(
        each.value for each in metrics if each.name == "adapter_a_person_more_500_over_100"
    )
    if growth > MAX_GROWTH:
        missed.append(
            f"one more person costs {growth:.2f} times as much in a large crowd, "
            f"at most {MAX_GROWTH:g} wanted"
        )
    return missed


if __name__ == "__main__":
    sys.exit(main())
