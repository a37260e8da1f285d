"""Command ``python -m benchmarks.tracking``: our tracker beside norfair and one plain filter each.

It judges them on the same simulated walkers and recorded people, and compares their processor time.
It also judges the prediction of places.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from awarenav.baseline import MeasuredValue

from .._harness import add_seed, count, finish, make_parser, parse
from ._cost import cost_table, two_sensor_table
from ._prediction import prediction_table
from ._scores import rate_table, score_table
from ._trackers import Contender, Naive, Norfair, Ours

BASELINE: Final = Path(__file__).with_name("baseline.json")
#: The baseline holds for runs of this size only.
STANDARD_SEEDS, STANDARD_FRAMES = 10, 500
PARTS: Final = ("scores", "rates", "cost", "prediction")
#: Recorded people lie beside the repository, if anywhere; see README.md.
RECORDINGS: Final = Path(__file__).resolve().parents[3] / "shared" / "data"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return 0 for success, 1 for a missed target, 2 for bad input."""
    parser = _parser()
    options, baseline = parse(parser, arguments)
    missing = [name for name in ("motmetrics", "trackeval") if find_spec(name) is None]
    if missing and {"scores", "rates"} & set(options.parts):
        parser.error(
            f"{' and '.join(missing)} not found; see benchmarks/tracking/requirements.txt "
            "or leave out what they judge (--parts cost prediction)"
        )
    makers: dict[str, Callable[[], Contender]] = {"ours": Ours, "naive": Naive}
    if find_spec("norfair") is not None:
        makers["norfair"] = Norfair
    else:
        print("left out, norfair: see benchmarks/tracking/requirements.txt", file=sys.stderr)
    seeds = range(options.seed, options.seed + options.seeds)
    tables: dict[str, Callable[[], tuple[list[MeasuredValue], list[str]]]] = {
        "scores": lambda: score_table(options.people, options.frames, seeds, makers),
        "rates": lambda: rate_table(seeds, makers, options.recordings),
        "cost": lambda: cost_table(options.seed, makers),
        "sensors": lambda: two_sensor_table(options.seed),
        "prediction": lambda: prediction_table(options.recordings),
    }
    metrics: list[MeasuredValue] = []
    missed: list[str] = []
    for part, table in tables.items():
        if (part if part != "sensors" else "cost") in options.parts:
            found, off = table()
            metrics += found
            missed += off
    standard = (options.seed, options.seeds, options.frames) == (0, STANDARD_SEEDS, STANDARD_FRAMES)
    if not standard:
        print("not compared with the baseline: it holds for the default seeds and frames")
        baseline = {}
    return finish(metrics, missed, baseline, options.out)


def _parser() -> argparse.ArgumentParser:
    parser = make_parser("benchmarks.tracking", (__doc__ or "").partition("\n\n")[2], BASELINE)
    parser.add_argument(
        "--people",
        nargs="+",
        type=count,
        default=[20],
        metavar="N",
        help="numbers of walkers, at a constant density (default: 20; the full run: 5 20 50 100)",
    )
    parser.add_argument(
        "--seeds", type=count, default=STANDARD_SEEDS, metavar="N", help="runs (default: 10)"
    )
    parser.add_argument(
        "--frames",
        type=count,
        default=STANDARD_FRAMES,
        metavar="N",
        help="frames per run, 20 per second (default: 500)",
    )
    parser.add_argument(
        "--parts",
        nargs="+",
        choices=PARTS,
        default=list(PARTS),
        metavar="NAME",
        help=f"some of {', '.join(PARTS)} (default: all)",
    )
    parser.add_argument(
        "--recordings",
        type=Path,
        default=RECORDINGS,
        metavar="DIR",
        help="CSV files of recorded people, t_s, id, x_m, y_m; left out if absent",
    )
    add_seed(parser)
    return parser


if __name__ == "__main__":
    raise SystemExit(main())
