"""Measures the processor time of crossings, and compares it with another checkout in one run.

    python -m benchmarks.episode_cost [--episodes 2] [--perception truth keypoints] [--against DIR]

Prints a Markdown table: seconds for 15 s of simulated time, reference planner and policy included,
imports not. With ``--against`` each crossing runs in both checkouts, one right after the other and
in changing order, so that the load of the computer is the same for both. The table then also says
whether the results of both are the same to the bit.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from benchmarks._harness import count, make_parser

#: Cheap, medium and costly scenarios; the last row is their mean.
SCENARIOS: Final = ("crossing_attentive", "crossing_from_left", "blind_corner", "crowd_of_eight")
_POLICY: Final = "balanced"
_SIMULATED_S: Final = 15.0
_HERE: Final = Path(__file__).resolve().parents[1]
_SERVER: Final = Path(__file__).with_name("_episode_server.py")


class Checkout:
    """A process that runs crossings with the packages of one checkout.

    Args:
        folder: the checkout.
    """

    def __init__(self, folder: Path) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", _SERVER.read_text()],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=folder,
            env=dict(os.environ, PYTHONPATH=str(folder), OMP_NUM_THREADS="1"),
        )

    def run(self, scenario: str, perception: str, seed: int) -> dict[str, Any]:
        """Run a crossing; return its ``processor_s``, ``simulated_s`` and ``digest``."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(
            json.dumps([scenario, _POLICY, perception, seed]), file=self._process.stdin, flush=True
        )
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"a crossing of {scenario!r} ended its process")
        found: dict[str, Any] = json.loads(line)
        return found

    def close(self) -> None:
        """End the process."""
        self._process.communicate()


def measured(
    checkouts: list[Checkout], scenario: str, perception: str, episodes: int
) -> tuple[list[float], bool]:
    """Return the cost in each checkout, and whether all of them gave the same results."""
    spent_s, simulated_s = [0.0] * len(checkouts), [0.0] * len(checkouts)
    same = True
    for checkout in checkouts:  # caches: once per process
        checkout.run(scenario, perception, episodes)
    for seed in range(episodes):
        digests = set()
        order = range(len(checkouts)) if seed % 2 == 0 else range(len(checkouts) - 1, -1, -1)
        for index in order:
            found = checkouts[index].run(scenario, perception, seed)
            spent_s[index] += found["processor_s"]
            simulated_s[index] += found["simulated_s"]
            digests.add(found["digest"])
        same &= len(digests) == 1
    return [
        _SIMULATED_S * spent / simulated
        for spent, simulated in zip(spent_s, simulated_s, strict=True)
    ], same


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and print."""
    parser = make_parser(
        "benchmarks.episode_cost",
        "Measure the processor time of crossings, and compare it with another checkout.",
    )
    parser.add_argument(
        "--episodes", type=count, default=2, metavar="N", help="seeds per scenario (default: 2)"
    )
    parser.add_argument("--perception", nargs="+", default=["truth", "keypoints"], metavar="NAME")
    parser.add_argument("--scenario", nargs="+", default=list(SCENARIOS), metavar="NAME")
    parser.add_argument(
        "--against", type=Path, metavar="DIR", help="another checkout, such as a git worktree"
    )
    options = parser.parse_args(arguments)
    folders = [_HERE]
    if options.against is not None:
        if not (options.against / "sim_tests").is_dir():
            parser.error(f"--against must be a checkout with sim_tests, got {options.against}")
        folders.insert(0, options.against.resolve())
    checkouts = [Checkout(folder) for folder in folders]
    if len(folders) == 1:
        print("| perception | scenario | processor s per 15 s |\n| --- | --- | --- |")
    else:
        print("| perception | scenario | before, s per 15 s | now, s per 15 s | ratio | same |")
        print("| --- | --- | --- | --- | --- | --- |")
    for perception in options.perception:
        rows = []
        for scenario in options.scenario:
            rows.append(measured(checkouts, scenario, perception, options.episodes))
            _print_row(perception, f"`{scenario}`", *rows[-1])
        means = [sum(costs) / len(rows) for costs in zip(*(row[0] for row in rows), strict=True)]
        _print_row(perception, "mean", means, all(row[1] for row in rows))
    for checkout in checkouts:
        checkout.close()
    return 0


def _print_row(perception: str, scenario: str, costs_s: list[float], same: bool) -> None:
    cells = [f"`{perception}`", scenario, *(f"{cost:.2f}" for cost in costs_s)]
    if len(costs_s) > 1:
        cells += [f"{costs_s[1] / costs_s[0]:.2f}", "yes" if same else "NO"]
    print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    raise SystemExit(main())
