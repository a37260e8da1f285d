"""Measures the cost of many episodes: processor time, memory, storage, and the gain of workers.

    python -m benchmarks.runs_scale [--episodes 4] [--pixels] [--dask]

Prints a Markdown table and a plan for a million episodes; docs/simulation_results.md has those of a
quiet computer. Cost is processor time of one process, so a busy computer changes it little. The
gain of two workers is wall time and needs a quiet computer. Memory is read with ``resource``: Linux
only.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks._harness import count, make_parser
from sim_tests.study.runs import Job, attempt, plan_jobs, run_jobs, tidy

#: Cheap, medium and costly scenarios; the figures are their mean.
SCENARIOS = ("crossing_attentive", "crossing_from_left", "blind_corner", "crowd_of_eight")
POLICIES = ("blind", "balanced")
MILLION = 1_000_000
_FILES = ("jobs.jsonl", "episodes.csv", "episodes.parquet")


def main() -> int:
    """Measure and print."""
    parser = make_parser(
        "benchmarks.runs_scale",
        "Measure the cost of many episodes: processor time, memory, storage, and the gain of "
        "workers.",
    )
    parser.add_argument(
        "--episodes", type=count, default=4, metavar="N", help="seeds per scenario (default: 4)"
    )
    parser.add_argument("--pixels", action="store_true", help="measure pixels too (minutes)")
    parser.add_argument("--dask", action="store_true", help="measure two Dask workers too")
    parser.add_argument("--of", metavar="PERCEPTION", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.of:  # in a process of its own, whose memory is that of a worker
        print(_cost(options.of, options.episodes))
        return 0
    kinds = ["truth", "keypoints", *(["pixels"] if options.pixels else [])]
    print("| perception | CPU s per episode | x real time | memory of a worker | 10⁶ episodes |")
    print("| --- | --- | --- | --- | --- |")
    for kind in kinds:
        command = [sys.executable, "-m", "benchmarks.runs_scale", "--of", kind]
        command += ["--episodes", str(options.episodes)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        cost_s, simulated_s, peak_mb = map(float, done.stdout.split())
        hours = cost_s * MILLION / 3600.0
        print(
            f"| `{kind}` | {cost_s:.2f} | {simulated_s / cost_s:.1f} | {peak_mb:.0f} MB | "
            f"{hours:,.0f} core hours |"
        )
    _print_storage_and_gain(options.episodes, options.dask)
    return 0


def _jobs(perception: str, episodes: int) -> tuple[Job, ...]:
    return plan_jobs(SCENARIOS, POLICIES, range(episodes), perception=perception)


def _cost(perception: str, episodes: int) -> str:
    """Return processor seconds and simulated seconds per episode, and peak memory in MB."""
    jobs = _jobs(perception, episodes)
    attempt(jobs[0])  # imports and caches: once per worker
    start, simulated_s = time.process_time(), 0.0
    for job in jobs:
        simulated_s += attempt(job).record.duration_s or 0.0
        tidy()
    cost_s = (time.process_time() - start) / len(jobs)
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return f"{cost_s} {simulated_s / len(jobs)} {peak_mb}"


def _print_storage_and_gain(episodes: int, dask: bool) -> None:
    """Run the same episodes in several ways; print file sizes and times."""
    jobs = _jobs("keypoints", episodes)
    times_s: dict[str, float] = {}
    tables = set()
    ways: dict[str, dict[str, object]] = {"1 worker": {"workers": 1}, "2 workers": {"workers": 2}}
    if dask:
        ways["2 Dask workers"] = {"workers": 2, "scheduler": "local"}
    with tempfile.TemporaryDirectory() as folder:
        for name, way in ways.items():
            out = Path(folder) / name
            start = time.perf_counter()
            run_jobs(jobs, out, progress=True, **way)  # type: ignore[arg-type]
            times_s[name] = time.perf_counter() - start
            tables.add((out / "episodes.csv").read_bytes())
        print("\n| file | bytes per episode | 10⁶ episodes |\n| --- | --- | --- |")
        for file in _FILES:
            path = out / file
            if path.exists():
                size = path.stat().st_size / len(jobs)
                print(f"| `{file}` | {size:.0f} | {size * MILLION / 1e9:.2f} GB |")
    print(f"\n{len(jobs)} episodes from keypoints, with the start of the processes:")
    for name, time_s in times_s.items():
        print(f"  {name:15s}{time_s:7.1f} s   x {times_s['1 worker'] / time_s:.2f}")
    print("  the same table, byte for byte" if len(tables) == 1 else "  DIFFERENT TABLES")


if __name__ == "__main__":
    sys.exit(main())
