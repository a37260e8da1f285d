"""Command line of the benchmark."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from tqdm import tqdm

from awarenav.baseline import MeasuredValue
from tracking import TrackerConfig, TrackingError

from .._harness import bad_input, count, finish, make_parser, parse
from ._consistency import on_own_model, on_walkers, open_gates
from ._contender import Contender, run
from ._cost import cost_ms
from ._figures import (
    INSIDE_TARGET,
    SCORE_HEADER,
    cost_metrics,
    missed_costs,
    missed_scores,
    score_line,
    score_metrics,
)
from ._judges import TrackingScores, judge
from ._measurements import OCCLUDED, OPEN, record
from ._naive import Naive, NaiveSettings
from ._norfair import Norfair
from ._ours import Ours
from ._prediction import fit_table, prediction_table
from ._prediction_sets import HORIZONS_S
from ._rates import rate_table
from ._stonesoup import StoneSoupGnn, StoneSoupJpda
from ._two_sensors import two_sensor_cost_ms

BASELINE = Path(__file__).with_name("baseline.json")
SETS = {"open": OPEN, "occluded": OCCLUDED}
#: The baseline holds for runs of this size only.
STANDARD_SEEDS, STANDARD_FRAMES = 10, 500
PARTS = ("scores", "rates", "cost", "sensors", "consistency", "prediction")
#: These need minutes; the last needs the simulator.
FIT, GAZE = "fit", "gaze"
#: Recorded people lie beside the repository, if anywhere; see README.md.
RECORDINGS = Path(__file__).resolve().parents[3] / "shared" / "data"
COST_PEOPLE = (20, 100, 300)
COST_FRAMES, COST_REPEATS = 150, 3
#: Wanted: an update with two sensors takes at most this much longer than with the camera alone.
MOST_FOR_TWO_SENSORS = 1.5
STEPS_S = (0.03, 0.05, 0.1, 0.2, 0.4)
CONSISTENCY_WALKERS, CONSISTENCY_FRAMES = 60, 60
_NEEDS = {"norfair": "norfair", "stonesoup-gnn": "stonesoup", "stonesoup-jpda": "stonesoup"}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return 0 for success, 1 for a missed goal, 2 for bad input."""
    parser = _parser()
    options, baseline = parse(parser, arguments)
    try:
        config = (
            TrackerConfig() if options.config is None else TrackerConfig.from_yaml(options.config)
        )
    except TrackingError as error:
        return bad_input(parser, error)
    judged = {"scores", "rates"} & set(options.parts)
    missing = [name for name in ("motmetrics", "trackeval") if find_spec(name) is None]
    if judged and missing:
        parser.error(
            f"{' and '.join(missing)} not found; see benchmarks/tracking/requirements.txt "
            "or leave out what they judge (--parts cost,sensors,consistency,prediction)"
        )
    makers = _makers(options.trackers, config)
    metrics: list[MeasuredValue] = []
    missed: list[str] = []
    if "scores" in options.parts:
        _scores(options, makers, metrics, missed)
    if "rates" in options.parts:
        _rates(options, config, metrics, missed)
    if "cost" in options.parts:
        _cost(options, makers, metrics, missed)
    if "sensors" in options.parts:
        _sensors(options, config, metrics, missed)
    if "consistency" in options.parts:
        _consistency(options, config, metrics, missed)
    if "prediction" in options.parts:
        found, off = prediction_table(options.recordings)
        metrics += found
        missed += off
    if FIT in options.parts:
        fit_table(options.recordings)
    if GAZE in options.parts:
        _gaze()
    return finish(metrics, missed, baseline if _is_standard(options) else {}, options.out)


def _parser() -> argparse.ArgumentParser:
    parser = make_parser(
        "benchmarks.tracking",
        "Run several trackers on the same simulated walkers, judge them with motmetrics and "
        "TrackEval, compare their processor time, and check the covariance of ours.",
        BASELINE,
    )
    parser.add_argument(
        "--people",
        type=_counts,
        default=[20],
        metavar="N,N",
        help="numbers of walkers, at a constant density (default: 20; the full run: 5,20,50,100)",
    )
    parser.add_argument(
        "--seeds",
        type=count,
        default=STANDARD_SEEDS,
        metavar="N",
        help="runs per set (default: 10)",
    )
    parser.add_argument(
        "--seed",
        type=int,
        default=0,
        metavar="S",
        help="first seed (default: 0; the trackers were tuned on seeds from 100 on)",
    )
    parser.add_argument(
        "--frames",
        type=count,
        default=STANDARD_FRAMES,
        metavar="N",
        help="frames per run, 20 per second (default: 500)",
    )
    parser.add_argument(
        "--sets",
        type=_subset(tuple(SETS)),
        default=list(SETS),
        metavar="NAMES",
        help="open, occluded (0.5–1 s out of sight after 2.5 s in sight) or both (default: both)",
    )
    parser.add_argument(
        "--trackers",
        type=_subset(("ours", "naive", *_NEEDS)),
        default=["ours", "naive", *_NEEDS],
        metavar="NAMES",
        help="some of ours, naive, norfair, stonesoup-gnn, stonesoup-jpda (default: all)",
    )
    parser.add_argument(
        "--parts",
        type=_subset((*PARTS, FIT, GAZE)),
        default=list(PARTS),
        metavar="NAMES",
        help=f"some of {', '.join(PARTS)} (default: these), {FIT}, {GAZE}",
    )
    parser.add_argument(
        "--stonesoup-up-to",
        type=count,
        default=20,
        metavar="N",
        help="leave Stone Soup out beyond N people; 100 people take an hour (default: 20)",
    )
    parser.add_argument(
        "--recordings",
        type=Path,
        default=RECORDINGS,
        metavar="DIR",
        help="CSV files of recorded people, t_s, id, x_m, y_m; left out if absent",
    )
    parser.add_argument("--config", type=Path, metavar="FILE", help="TrackerConfig for ours (YAML)")
    return parser


def _counts(text: str) -> list[int]:
    return [count(part) for part in text.split(",")]


def _subset(valid: Sequence[str]) -> Callable[[str], list[str]]:
    def parse(text: str) -> list[str]:
        chosen = text.split(",")
        for name in chosen:
            if name not in valid:
                raise argparse.ArgumentTypeError(f"must be of {', '.join(valid)}; got {name!r}")
        return chosen

    return parse


def _makers(names: Sequence[str], config: TrackerConfig) -> dict[str, Callable[[], Contender]]:
    """Return a maker for each tracker that is installed; print which ones are left out."""
    makers: dict[str, Callable[[], Contender]] = {
        "ours": lambda: Ours(config),
        "naive": Naive,
        "norfair": Norfair,
        "stonesoup-gnn": StoneSoupGnn,
        "stonesoup-jpda": StoneSoupJpda,
    }
    chosen = {}
    for name in names:
        if name in _NEEDS and find_spec(_NEEDS[name]) is None:
            print(f"left out, {name}: see benchmarks/tracking/requirements.txt", file=sys.stderr)
        else:
            chosen[name] = makers[name]
    return chosen


def _is_standard(options: argparse.Namespace) -> bool:
    """Return whether the figures may be compared with the baseline; print when not."""
    standard = (options.seed, options.seeds, options.frames) == (0, STANDARD_SEEDS, STANDARD_FRAMES)
    if not standard or options.config is not None:
        print("not compared with the baseline: it holds for the default seeds, frames and settings")
        return False
    return True


def _affordable(
    options: argparse.Namespace, makers: dict[str, Callable[[], Contender]], people: int
) -> dict[str, Callable[[], Contender]]:
    """Return the trackers, without Stone Soup where it would take hours."""
    if people <= options.stonesoup_up_to:
        return makers
    return {name: make for name, make in makers.items() if not name.startswith("stonesoup")}


def _scores(
    options: argparse.Namespace,
    makers: dict[str, Callable[[], Contender]],
    metrics: list[MeasuredValue],
    missed: list[str],
) -> None:
    """Judge the trackers on every set and number of people."""
    print(SCORE_HEADER)
    for name in options.sets:
        for people in options.people:
            chosen = _affordable(options, makers, people)
            scores: dict[str, list[TrackingScores]] = {tracker: [] for tracker in chosen}
            with tqdm(
                total=options.seeds * len(chosen),
                desc=f"{name}, {people} people",
                unit="run",
                leave=False,
                file=sys.stderr,
            ) as bar:
                for seed in range(options.seed, options.seed + options.seeds):
                    rng = np.random.default_rng([seed, people])
                    recording = record(people, options.frames, rng, SETS[name])
                    for tracker, make in chosen.items():
                        score = judge(recording.truth, run(make(), recording))
                        if (apart := score.disagreement()) is not None:
                            missed.append(
                                f"{name}, {people} people, seed {seed}, {tracker}: {apart}"
                            )
                        scores[tracker].append(score)
                        bar.update()
            for tracker, runs in scores.items():
                print(score_line(name, people, tracker, runs), flush=True)
                metrics += score_metrics(name, people, tracker, runs)
                if options.frames >= STANDARD_FRAMES:
                    missed += missed_scores(name, people, tracker, runs)


def _rates(
    options: argparse.Namespace,
    config: TrackerConfig,
    metrics: list[MeasuredValue],
    missed: list[str],
) -> None:
    """Compare the trackers at every frame rate."""
    makers: dict[str, Callable[[], Contender]] = {
        "ours": lambda: Ours(config),
        "naive": Naive,
        "naive, 3 hits": lambda: Naive(NaiveSettings(confirm_hits=3)),
    }
    if "norfair" in options.trackers and find_spec("norfair") is not None:
        makers["norfair"] = Norfair
    seeds = range(options.seed, options.seed + options.seeds)
    sets = {name: SETS[name] for name in options.sets}
    found, worse = rate_table(sets, makers, seeds, options.recordings)
    metrics += found
    missed += worse


def _cost(
    options: argparse.Namespace,
    makers: dict[str, Callable[[], Contender]],
    metrics: list[MeasuredValue],
    missed: list[str],
) -> None:
    """Compare the processor time of the trackers."""
    print(f"\n{'processor time':16s}{'people':>6s}{'update, ms':>12s}{'with input':>12s}", end="")
    print(f"{'ours over it':>14s}")
    for people in COST_PEOPLE:
        rng = np.random.default_rng([options.seed, people])
        recording = record(people, COST_FRAMES, rng, OPEN)
        chosen = _affordable(options, makers, people)
        alone, cost = cost_ms([make() for make in chosen.values()], recording, COST_REPEATS)
        for tracker, value in cost.items():
            ratio = f"{cost['ours'] / value:14.3f}" if "ours" in cost else f"{'-':>14s}"
            print(f"{tracker:16s}{people:6d}{alone[tracker]:12.3f}{value:12.3f}{ratio}", flush=True)
        metrics += cost_metrics(people, cost)
        missed += missed_costs(people, cost)


def _sensors(
    options: argparse.Namespace,
    config: TrackerConfig,
    metrics: list[MeasuredValue],
    missed: list[str],
) -> None:
    """Compare the processor time of an update with one sensor and with two."""
    print(f"\n{'processor time':20s}{'people':>6s}{'update, ms':>12s}{'over camera':>14s}")
    rng = np.random.default_rng([options.seed, COST_PEOPLE[0]])
    recording = record(COST_PEOPLE[0], COST_FRAMES, rng, OPEN)
    cost = two_sensor_cost_ms(recording, config, COST_REPEATS)
    for name, value in cost.items():
        ratio = value / cost["camera"]
        print(f"{name:20s}{COST_PEOPLE[0]:6d}{value:12.3f}{ratio:14.3f}", flush=True)
        if ratio > MOST_FOR_TWO_SENSORS:
            missed.append(f"an update with {name} takes {ratio:.2f} times as long")
    both = cost["camera and scanner"] / cost["camera"]
    metrics.append(
        MeasuredValue(f"cost_{COST_PEOPLE[0]}_two_sensors_over_one", both, "x", "lower", 0.4)
    )


def _consistency(
    options: argparse.Namespace,
    config: TrackerConfig,
    metrics: list[MeasuredValue],
    missed: list[str],
) -> None:
    """Check the covariance of our tracker."""
    wide = open_gates(config)
    print(f"\n{'consistency of ours':28s}{'NEES':>7s}{'in band':>9s}{'NIS':>7s}{'95 % band':>15s}")
    for dt_s in tqdm(STEPS_S, desc="consistency", leave=False, file=sys.stderr):
        rng = np.random.default_rng([options.seed, round(1e3 * dt_s)])
        found = on_own_model(dt_s, CONSISTENCY_WALKERS, CONSISTENCY_FRAMES, rng, wide)
        low, high = found.nis_band
        tqdm.write(
            f"{f'own model, dt {dt_s:g} s':28s}{found.nees:7.3f}{found.nees_inside:9.0%}"
            f"{found.nis:7.3f}{f'{low:.3f}–{high:.3f}':>15s}"
        )
        if found.nees_inside < INSIDE_TARGET:
            missed.append(f"NEES at dt {dt_s:g} s: {found.nees_inside:.0%} of frames in their band")
        if not low <= found.nis <= high:
            missed.append(f"NIS at dt {dt_s:g} s: {found.nis:.3f}, {low:.3f} to {high:.3f} wanted")
    for name in options.sets:
        recording = record(20, 200, np.random.default_rng([options.seed, 20]), SETS[name])
        for key, value in on_walkers(recording, config).items():
            print(f"walkers, {name}: {key.replace('_', ' ')}: {value:.2f}")
            metrics.append(MeasuredValue(f"{name}_20_{key}", value, "1", "lower", 0.3))


def _gaze() -> None:
    """Print the value of gaze and body heading for the prediction."""
    # Needs the simulator.
    from ._prediction_gaze import gaze_gains  # noqa: PLC0415

    print(f"\n{'error ahead, m':28s}" + "".join(f"{each:>8g} s" for each in HORIZONS_S))
    for name, errors_m in gaze_gains(range(100, 112), range(12)).items():
        print(f"{name:28s}" + "".join(f"{each:10.4f}" for each in errors_m), flush=True)
