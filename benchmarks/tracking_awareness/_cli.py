"""Command line of the benchmark."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Final

import numpy as np
from tqdm import tqdm

from awarenav.baseline import Direction, MeasuredValue
from tracking import AwarenessFilterConfig, TrackerConfig

from .._harness import finish, make_parser, parse
from ._attention import Attention, FloatArray, simulate
from ._camera import Measured, measure, track
from ._filters import Filter, HistogramFilter, LogitGaussian, Smoothed, hold_latest
from ._hard_cli import run as run_hard
from ._plot import plot
from ._scores import FALSE_SHARE, AwarenessScores, score, threshold_for

BASELINE: Final = Path(__file__).with_name("baseline.json")
RATES_HZ: Final = (10.0, 20.0, 30.0)
OURS: Final = "tracker"
#: Seeds of the hard simulation, counted from the one given.
HARD_SEEDS: Final = 4

#: Wanted range of each figure of the tracker.
TARGETS: Final[dict[str, tuple[float, float]]] = {
    "coverage": (0.88, 0.97),
    "false_unseen": (0.0, 0.0),
    "above_unseen": (0.0, 0.0),
    "recall": (0.42, 1.0),
    "onset_s": (0.0, 0.5),
    "release_s": (0.0, 0.35),
}


@dataclass(frozen=True, slots=True)
class SimulatedSet:
    """Simulated people and their measurements."""

    rate_hz: float
    attention: Attention
    measured: Measured


Contender = Callable[[SimulatedSet], tuple[FloatArray, FloatArray]]


def contenders() -> dict[str, Contender]:
    """Return the tracker and the filters that were tried, by name."""

    def alone(one: Filter) -> Contender:
        return lambda data: one(data.attention.stamps_s, data.measured)

    return {
        OURS: lambda data: track(data.attention, data.measured, TrackerConfig()),
        "… with a memory of 1 s": lambda data: track(
            data.attention,
            data.measured,
            TrackerConfig(awareness=AwarenessFilterConfig(memory_s=1.0)),
        ),
        # The rest without a tracker, which loses some frames to births and ambiguous matches.
        "the tracker's filter, alone": alone(LogitGaussian()),
        "… with a narrower prior (σ 1.5)": alone(
            LogitGaussian(AwarenessFilterConfig(prior_std_logit=1.5))
        ),
        "… quick down: low outliers reset": alone(LogitGaussian(reset_below_sigmas=2.5)),
        "… slow up: a jump takes two frames": alone(LogitGaussian(reset_above_sigmas=2.5)),
        "… with a lasting error estimated": alone(LogitGaussian(bias_std_logit=0.5)),
        "histogram of α that jumps": alone(HistogramFilter()),
        "two states (HMM; bound is P(aware))": alone(HistogramFilter(bins=2)),
        "exponential smoothing of α": alone(Smoothed()),
        "latest α held until the next": alone(hold_latest),
    }


def make_set(seed: int, rate_hz: float, people: int, duration_s: float) -> SimulatedSet:
    """Return a simulated set, which depends on its arguments alone."""
    rng = np.random.default_rng([seed, round(rate_hz)])
    attention = simulate(rng, people, duration_s, rate_hz)
    return SimulatedSet(rate_hz, attention, measure(attention, rng))


def judge(data: SimulatedSet, lower: FloatArray, threshold: float) -> AwarenessScores:
    """Return the scores of a lower bound on a set."""
    measured = data.measured
    return score(
        data.attention.stamps_s,
        data.attention.awareness,
        measured.seen,
        ~np.isnan(measured.awareness),
        lower,
        threshold,
    )


def missed_targets(scores: AwarenessScores) -> list[str]:
    """Return the names of the figures outside their wanted range; NaN is outside."""
    return [
        name for name, (low, high) in TARGETS.items() if not low <= getattr(scores, name) <= high
    ]


def metrics(rate_hz: float, scores: AwarenessScores) -> list[MeasuredValue]:
    """Return the tracker's figures for the baseline; they do not depend on the computer."""
    found = []
    for name in TARGETS:
        higher = name in ("coverage", "recall")
        direction: Direction = "higher" if higher else "lower"
        unit = "s" if name.endswith("_s") else "share"
        value = float(getattr(scores, name))
        # One frame for times, two per cent for shares.
        tolerance = 0.02 if unit == "share" else 1.0 / (rate_hz * max(value, 1.0 / rate_hz))
        found.append(MeasuredValue(f"{rate_hz:g}hz_{name}", value, unit, direction, tolerance))
    return found


def table_row(name: str, threshold: float, scores: AwarenessScores) -> str:
    """Return one row of the table."""
    values = (getattr(scores, field.name) for field in fields(scores))
    return f"{name:46s}{threshold:7.3f}" + "".join(f"{value:10.3f}" for value in values)


HEADER: Final = (
    f"{'':46s}{'at':>7s}{'holds':>10s}{'.. α > 0':>10s}{'false':>10s}{'.. unseen':>10s}"
    f"{'> unseen':>10s}{'recall':>10s}{'onset s':>10s}{'.. found':>10s}{'release s':>10s}"
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return 0 for success, 1 for a missed target or a worse figure."""
    options, baseline = _parse(arguments)
    if options.hard:
        tune, test = (
            [seed + shift for shift in range(HARD_SEEDS)]
            for seed in (options.train_seed, options.test_seed)
        )
        faults = run_hard(tune, test, options.people, options.duration, options.only_ours)
        return finish([], faults, {}, None)
    judged = {OURS: contenders()[OURS]} if options.only_ours else contenders()
    found: list[MeasuredValue] = []
    faults = []
    with tqdm(total=len(RATES_HZ) * len(judged), unit="filter", file=sys.stderr) as bar:
        for rate_hz in RATES_HZ:
            train, test = (
                make_set(seed, rate_hz, options.people, options.duration)
                for seed in (options.train_seed, options.test_seed)
            )
            bar.write(f"{rate_hz:g} Hz\n{HEADER}", file=sys.stdout)
            for name, one in judged.items():
                threshold = threshold_for(one(train)[1], train.attention.awareness, FALSE_SHARE)
                awareness, lower = one(test)
                scores = judge(test, lower, threshold)
                bar.write(table_row(name, threshold, scores), file=sys.stdout)
                bar.update()
                if name != OURS:
                    continue
                faults += [
                    f"{rate_hz:g} Hz: {fault} misses its target" for fault in missed_targets(scores)
                ]
                found += metrics(rate_hz, scores)
                if options.plot is not None and rate_hz == 20.0:
                    plot(
                        options.plot, test.attention, test.measured, awareness, lower, threshold,
                        options.person,
                    )  # fmt: skip
    return finish(found, faults, baseline, options.out)


def _parse(arguments: Sequence[str] | None) -> tuple[argparse.Namespace, dict[str, MeasuredValue]]:
    """Return the options of the command line and the baseline that they name."""
    parser = make_parser(
        "benchmarks.tracking_awareness",
        "Judge awareness over time on simulated attention. People walk about in front of a robot "
        "and glance at it. A camera measures α ± σ with errors that last, and misses people and "
        "faces. The threshold on the lower bound is set on the training seed for 1 % false "
        "awareness and judged on the test seed.",
        BASELINE,
    )
    parser.add_argument("--people", type=int, default=40, metavar="N", help="default: 40")
    parser.add_argument(
        "--duration", type=float, default=60.0, metavar="S", help="seconds per person (default: 60)"
    )
    parser.add_argument("--train-seed", type=int, default=1, metavar="N", help="default: 1")
    parser.add_argument("--test-seed", type=int, default=101, metavar="N", help="default: 101")
    parser.add_argument(
        "--hard",
        action="store_true",
        help="another, harder simulation, without a baseline; see README.md",
    )
    parser.add_argument("--only-ours", action="store_true", help="leave the other filters out")
    parser.add_argument("--plot", type=Path, metavar="FILE.png", help="draw one person at 20 Hz")
    parser.add_argument("--person", type=int, default=0, metavar="N", help="the person to draw")
    options, baseline = parse(parser, arguments)
    if options.people < 1 or not 5.0 <= options.duration <= 3600.0:
        parser.error("--people must be at least 1 and --duration 5 to 3600 s")
    if not 0 <= options.person < options.people:
        parser.error(f"--person must be 0 to {options.people - 1}, got {options.person}")
    if options.train_seed < 0 or options.test_seed < 0 or options.train_seed == options.test_seed:
        parser.error("--train-seed and --test-seed must be two different numbers of 0 or more")
    if options.plot is not None and not options.plot.absolute().parent.is_dir():
        parser.error(f"--plot: there is no folder {options.plot.parent}")
    if options.hard and (options.plot is not None or options.out is not None):
        parser.error("--hard has no plot and no baseline: leave --plot and --out out")
    if options.hard and abs(options.train_seed - options.test_seed) < HARD_SEEDS:
        parser.error(f"--hard: the seeds must be at least {HARD_SEEDS} apart, none is used twice")
    if options.plot is not None and options.plot.suffix != ".png":
        parser.error(f"--plot must name a .png file, got {options.plot}")
    return options, baseline
