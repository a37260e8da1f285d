"""The command ``awarenav``."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from nav_adapter import NavError
from perception import PerceptionError
from tracking import TrackingError

from ._errors import SimError
from .bridge._command import add_parser as add_bridge_parser
from .catalogue._command import add_parser as add_scenario_parser
from .estimates._command import add_parsers as add_estimate_parsers
from .falsify._command import add_parser as add_falsify_parser
from .measures._command import add_parser as add_compare_parser
from .models._command import add_parser as add_models_parser
from .policies._command import add_parser as add_policy_parser
from .report._command import add_parser as add_report_parser
from .runs._command import add_parsers as add_run_parsers
from .sets._command import add_parser as add_render_parser
from .tracks._command import add_parser as add_tracks_parser
from .tuning._command import add_parser as add_tune_parser

# What the extra "sim" installs.
_SIMULATOR_MODULES = ("av", "matplotlib", "pybullet")
_BASELINE = Path("benchmarks") / "baseline.json"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit status: 0 well, 1 a gate failed, 2 bad input."""
    parser = _parser()
    options = parser.parse_args(arguments)
    try:
        status: int = options.run(options)
    except (NavError, PerceptionError, SimError, TrackingError) as error:
        print(f"awarenav {options.command}: {error}", file=sys.stderr)
        return 2
    except ModuleNotFoundError as error:
        if error.name not in _SIMULATOR_MODULES:
            raise
        print(
            f"awarenav {options.command}: needs {error.name}, which is not installed; it is part "
            "of the extra 'sim': pip install 'awarenav[sim]'",
            file=sys.stderr,
        )
        return 2
    except BrokenPipeError:  # who read our output, such as head, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        print(f"\nawarenav {options.command}: interrupted; partial results kept", file=sys.stderr)
        return 130
    return status


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="awarenav",
        description="Awareness-aware navigation: see who has noticed the robot, move accordingly.",
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    demo = commands.add_parser(
        "demo",
        help="the paper's encounter and what awareness buys in a crossing",
        description="Run the paper's 25 s encounter and the same crossing with and without "
        "awareness; print the tables and write encounter.png, encounter.mp4, encounter.csv, "
        "crossings.png and episodes.csv.",
    )
    _add_out(demo, "demo")
    _add_seed(demo)
    demo.add_argument("--no-video", action="store_true", help="leave the video out (faster)")
    demo.add_argument(
        "--perception",
        choices=["keypoints", "pixels"],
        default="keypoints",
        help="what the robot sees with; pixels render every frame and take many minutes "
        "(default: keypoints)",
    )
    demo.set_defaults(run=_demo)

    add_run_parsers(commands)
    add_render_parser(commands)
    add_models_parser(commands)
    add_estimate_parsers(commands)
    add_tracks_parser(commands)
    add_policy_parser(commands)
    add_scenario_parser(commands)
    add_bridge_parser(commands)
    add_tune_parser(commands)
    add_falsify_parser(commands)
    add_report_parser(commands)
    add_compare_parser(commands)

    bench = commands.add_parser(
        "bench",
        help="measure how fast crossings run",
        description="Time crossings against real time and against bare physics, and compare with a "
        "baseline; exit status 1 when a figure is worse than its tolerance allows.",
    )
    bench.add_argument(
        "--baseline",
        type=Path,
        default=_BASELINE,
        metavar="FILE",
        help=f"baseline to compare with, if it exists (default: {_BASELINE})",
    )
    bench.add_argument("--out", type=Path, metavar="FILE", help="write the figures as a baseline")
    bench.set_defaults(run=_bench)
    return parser


def _add_out(parser: argparse.ArgumentParser, default: str) -> None:
    parser.add_argument(
        "--out",
        type=Path,
        default=Path(default),
        metavar="DIR",
        help=f"folder for the results (default: {default})",
    )


def _add_seed(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="of everything random (default: 0)"
    )


# The simulator is imported when a command needs it, so that help works without it.
def _demo(options: argparse.Namespace) -> int:
    from ._demo import run_demo  # noqa: PLC0415

    run_demo(
        options.out,
        seed=options.seed,
        video=not options.no_video,
        perception=options.perception,
    )
    return 0


def _bench(options: argparse.Namespace) -> int:
    from ._bench import measure, read_baseline, report, write_baseline  # noqa: PLC0415

    baseline = read_baseline(options.baseline) if options.baseline.exists() else {}
    metrics = measure()
    text, good = report(metrics, baseline)
    print(text)
    if options.out is not None:
        write_baseline(options.out, metrics)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
