"""Command ``python -m examples.planners``: a Markdown table of crossings with every planner."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import cast

from tqdm import tqdm

from sim_tests import NOVA_CARTER, LocalPlanner, SamplingPlanner

from ._compare import HEADER, Row, compare, scenario

# Package that the planner needs, module here, and class.
_OTHERS = {
    "ir-sim": ("irsim", "velocity_obstacles", "VelocityObstaclePlanner"),
    "do-mpc": ("do_mpc", "model_predictive", "ModelPredictivePlanner"),
}
_NAMES = ("reference", *_OTHERS)
_CASES = 4


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the comparison; return 0 if every crossing was good, 1 if not, 2 without a planner."""
    parser = argparse.ArgumentParser(
        prog="python -m examples.planners",
        description="Cross a warehouse in PyBullet with the reference planner and third-party "
        "planners: with nobody there, with a worker who watches the robot, with one who does not, "
        "and with a wider radius for that one.",
    )
    parser.add_argument(
        "--planner",
        choices=_NAMES,
        action="append",
        help="planner to run; may be given more than once (default: all that are installed)",
    )
    parser.add_argument(
        "--perception",
        choices=("truth", "keypoints", "pixels"),
        default="truth",
        help="perception of the robot (default: truth, in all directions and through walls)",
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of every crossing (default: 0)")
    parser.add_argument(
        "--circles-alone",
        action="store_true",
        help="third-party planners plan with the circles and the present limit, not with the "
        "speed field; the reference planner is the same",
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="also write the table into a file")
    options = parser.parse_args(arguments)
    if options.seed < 0:
        parser.error(f"--seed must be 0 or more, got {options.seed}")
    if options.out is not None and not options.out.parent.is_dir():
        parser.error(f"--out must be a file in a folder that exists, got {options.out}")
    rows: list[Row] = []
    chosen = []
    for name in options.planner or _NAMES:
        if name in _OTHERS and find_spec(_OTHERS[name][0]) is None:
            print(f"left out, {name} is not installed: pip install {name}", file=sys.stderr)
        else:
            chosen.append(name)
    if not chosen:
        return 2
    with tqdm(total=_CASES * len(chosen), unit="crossing", file=sys.stderr, leave=False) as bar:
        for name in chosen:
            bar.set_description(name)
            rows += compare(
                name,
                _maker(name, use_speed_field=not options.circles_alone),
                perception=options.perception,
                seed=options.seed,
                done=lambda _: bar.update(),
            )
    table = "\n".join([HEADER, *(row.line() for row in rows)])
    print(table)
    if options.out is not None:
        options.out.write_text(table + "\n", encoding="utf-8")
    return 0 if rows and all(row.is_good for row in rows) else 1


def _maker(name: str, *, use_speed_field: bool) -> Callable[[], LocalPlanner]:
    """Return a function that makes a new planner, which knows the racks and walls."""
    boxes = scenario("crossing_attentive").planner_boxes_odom_m
    if name == "reference":
        return lambda: SamplingPlanner(NOVA_CARTER, boxes)
    # Imported late: the packages are optional, and take a second to import.
    _, module, planner = _OTHERS[name]
    make = getattr(import_module(f".{module}", __package__), planner)
    return lambda: cast(
        LocalPlanner,
        make(NOVA_CARTER, static_boxes_odom_m=boxes, use_speed_field=use_speed_field),
    )


if __name__ == "__main__":
    sys.exit(main())
