"""The commands ``awarenav crossings`` and ``awarenav replay``."""

from __future__ import annotations

import argparse
from pathlib import Path

from .._arguments import add_camera, count


def add_parsers(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``crossings`` and ``replay`` to the commands."""
    _add_crossings(commands)
    _add_replay(commands)


def _add_crossings(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    crossings = commands.add_parser(
        "crossings",
        help="run closed-loop crossings: every scenario, policy, planner and fault, on all cores",
        description="Run every scenario with every policy, planner and fault on the same seeds, in "
        "closed loop. A row goes to episodes.csv as soon as an episode is done; at the end the "
        "rows are put in order, and the report is written. An episode that fails says why in its "
        "row and costs no other.",
        epilog="Exit status: 0 well, 1 some episodes failed (DIR/errors.log says how), 2 bad input "
        "and nothing run. A run that was killed goes on with the same arguments and --resume. "
        "`awarenav replay DIR N` shows episode N; `awarenav compare DIR` prints more tables.",
    )
    crossings.add_argument(
        "--scenario",
        nargs="+",
        default=["all"],
        metavar="NAME|FILE",
        help="shipped scenarios, YAML files, or 'all' that have a planner (default)",
    )
    crossings.add_argument(
        "--policy",
        nargs="+",
        default=["blind", "balanced"],
        metavar="NAME|FILE",
        help="presets, policy YAML files, or 'oracle': balanced, which knows the truth "
        "(default: blind balanced)",
    )
    crossings.add_argument(
        "--planner",
        nargs="+",
        default=[""],
        metavar="MODULE:CLASS",
        help="your own planners, made with the robot's profile, and with static_boxes_odom_m if "
        "they take that; 'reference' for the reference planner (default)",
    )
    crossings.add_argument(
        "--perception",
        choices=["truth", "keypoints", "pixels"],
        default="keypoints",
        help="what the robot sees with (default: keypoints)",
    )
    add_camera(crossings)
    crossings.add_argument(
        "--fault",
        nargs="+",
        default=["none"],
        metavar="NAME|FILE",
        help="shipped faults, YAML files, or 'none' (default); each is a run of its own",
    )
    crossings.add_argument(
        "--episodes", type=count, default=1, metavar="N", help="seeds a scenario (default: 1)"
    )
    crossings.add_argument(
        "--seed", type=_seed, default=0, metavar="N", help="the first of them (default: 0)"
    )
    crossings.add_argument(
        "--workers", type=count, metavar="N", help="processes (default: one a core)"
    )
    crossings.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="run on a Dask cluster: tcp://HOST:PORT, or 'local' for one of --workers processes",
    )
    crossings.add_argument(
        "--time-limit",
        type=float,
        metavar="S",
        help="end an episode that takes longer by the clock, such as one whose planner hangs "
        "(default: none)",
    )
    crossings.add_argument(
        "--out",
        type=Path,
        default=Path("crossings"),
        metavar="DIR",
        help="folder for the results (default: crossings)",
    )
    crossings.add_argument(
        "--resume", action="store_true", help="go on with the run in DIR that was interrupted"
    )
    crossings.add_argument("--no-report", action="store_true", help="write no report")
    crossings.set_defaults(run=_crossings)


def _add_replay(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    replay = commands.add_parser(
        "replay",
        help="run one episode of a run again: video, map, and whether it ends the same",
        description="Run one episode of a run again, film it, draw it from above, and say whether "
        "it gives the same row as before.",
        epilog="Exit status: 0 the same row, 1 another one, 2 bad input.",
    )
    replay.add_argument("dir", type=Path, metavar="DIR", help="folder of the run")
    replay.add_argument(
        "episode",
        metavar="EPISODE",
        help="its number, counted from 0 in the order of episodes.csv and jobs.jsonl; or "
        "SCENARIO:SEED:POLICY, and :PLANNER, :FAULT behind where that is not enough",
    )
    replay.add_argument(
        "--out", type=Path, metavar="DIR", help="folder for the pictures (default: DIR/replays)"
    )
    replay.add_argument("--no-video", action="store_true", help="draw the map only (faster)")
    replay.set_defaults(run=_replay)


def _seed(text: str) -> int:
    number = _whole(text)
    if number < 0:
        raise argparse.ArgumentTypeError(f"must be at least 0, got {number}")
    return number


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError as cause:
        raise argparse.ArgumentTypeError(f"must be a whole number, got {text!r}") from cause


# The simulator is imported when a command needs it, so that help works without it.
def _crossings(options: argparse.Namespace) -> int:
    from ._crossings import crossings_command  # noqa: PLC0415

    return crossings_command(options)


def _replay(options: argparse.Namespace) -> int:
    from ._replay import replay_command  # noqa: PLC0415

    return replay_command(options)
