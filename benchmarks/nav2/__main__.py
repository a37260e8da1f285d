"""The command ``python -m benchmarks.nav2``: crossings under Nav2, controller by controller."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from awarenav.errors import AwarenavError
from benchmarks._harness import count, make_parser
from sim_tests.study.measures import read_records, write_records
from sim_tests.study.runs import RunFiles, plan_jobs, read_attempts, run_jobs

from . import behaviours
from ._results import table, write_excess
from .behaviours import nav2
from .parameters import CONTROLLERS, FACES

_TIME_LIMIT_S: Final = 300.0


def measure(
    out: Path,
    controller: str,
    face: str,
    *,
    scenarios: Sequence[str],
    seeds: int,
    policies: Sequence[str],
    robot: str,
    perception: str,
    settings: str,
    bare: bool,
) -> None:
    """Run the missing crossings of a controller with a face, in a folder of their own."""
    alone = ", limit='nobody'" if face == "today" else ""
    jobs = plan_jobs(
        scenarios,
        # Alone, no policy reaches the stack; the measures are those of one.
        policies if face != "today" else ["balanced"],
        range(seeds),
        planners=[f"ros2(goal='follow_path'{alone}{settings})"],
        perception=perception.removesuffix("+scanner"),
        sensors=["camera+scanner" if perception.endswith("+scanner") else "camera"],
        robot=robot,
    )
    folder = out / "_".join(
        [controller, face, *(["bare"] if bare else []), *([Path(robot).stem] if robot else [])]
    )
    files = RunFiles(folder)
    with contextlib.suppress(AwarenavError, OSError):
        if {each.conditions for each in read_records(files.episodes)} == {
            job.conditions for job in jobs
        }:
            return
    words = ["--face", face, *(["--bare"] if bare else [])]
    with nav2(controller, *words, log=out / f"{folder.name}.log"):
        run_jobs(
            jobs,
            folder,
            workers=1,
            time_limit_s=_TIME_LIMIT_S,
            resume=files.jobs.exists(),
            progress=True,
        )


def collect(out: Path) -> Path:
    """Write the rows of all folders as one table, whose planners are controllers and faces.

    ``excess.csv`` beside it has how far the fastest point of the robot was above the limit.
    """
    rows, conducts = [], []
    for path in sorted(out.glob("*/episodes.csv")):
        controller, face, *_ = path.parent.name.split("_")
        for attempt in read_attempts(path.parent).values():
            rows.append(replace(attempt.record, planner=f"{controller}, {face}"))
            conducts.append(attempt.conduct)
    table = out / "rows.csv"
    write_records(table, rows)
    write_excess(table, rows, conducts)
    return table


def main() -> int:
    """Run the command; return 2 for bad input."""
    parser = make_parser(
        "benchmarks.nav2",
        "Drive crossings with a Nav2 that is started here, in real time. Source a ROS environment "
        "first. An interrupted run continues with the same command.",
    )
    parser.add_argument("--controller", nargs="+", choices=CONTROLLERS, default=list(CONTROLLERS))
    parser.add_argument("--face", nargs="+", choices=FACES, default=list(FACES))
    parser.add_argument("--scenario", nargs="+", default=["all"], metavar="NAME")
    parser.add_argument("--policy", nargs="+", default=["balanced", "blind"], metavar="NAME")
    parser.add_argument("--robot", default="", metavar="NAME|FILE", help="another robot")
    parser.add_argument("--seeds", type=count, default=3, metavar="N")
    parser.add_argument("--perception", default="truth", metavar="NAME")
    parser.add_argument("--settings", default="", help="of the planner, such as ', pace=2'")
    parser.add_argument("--bare", action="store_true", help="no smoother, no collision monitor")
    parser.add_argument("--domain", default="77", help="ROS_DOMAIN_ID")
    parser.add_argument("--out", type=Path, default=Path("runs/nav2"), metavar="FOLDER")
    parser.add_argument(
        "--behaviours", action="store_true", help="beside somebody who stands; no crossings"
    )
    parser.add_argument("--results", action="store_true", help="print the committed table; no run")
    options = parser.parse_args()
    if options.results:
        print(table())
        return 0
    os.environ["ROS_DOMAIN_ID"] = options.domain
    options.out.mkdir(parents=True, exist_ok=True)
    try:
        if options.behaviours:
            print(behaviours.table(options.out / "behaviours.log"))
            return 0
        for controller in options.controller:
            for face in options.face:
                measure(
                    options.out,
                    controller,
                    face,
                    scenarios=options.scenario,
                    seeds=options.seeds,
                    policies=options.policy,
                    robot=options.robot,
                    perception=options.perception,
                    settings=options.settings,
                    bare=options.bare,
                )
                print(f"written: {collect(options.out)}")
    except AwarenavError as error:
        print(f"nav2: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
