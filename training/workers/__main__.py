"""Command ``python -m training.workers``: make the workers that ship with ``sim_tests``.

With ``--random N`` it makes a random crowd instead, as training data of the networks.
"""

from __future__ import annotations

import argparse
import multiprocessing
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from ._make import make
from ._people import PEOPLE
from ._random import random_person

_FOLDER = Path(__file__).parents[2] / "sim_tests" / "actors" / "body" / "workers"


def main() -> None:
    """Make all workers, or the named ones."""
    parser = argparse.ArgumentParser(prog="python -m training.workers", description=__doc__)
    parser.add_argument("names", nargs="*", help="workers to make (default: all)")
    parser.add_argument("--out", type=Path, default=_FOLDER, help="folder (default: %(default)s)")
    parser.add_argument("--jobs", type=int, default=1, help="processes (default: %(default)s)")
    parser.add_argument(
        "--random", type=int, default=0, metavar="N", help="make N random workers instead"
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of the random workers")
    chosen = parser.parse_args()
    if chosen.random and chosen.out == _FOLDER:
        parser.error("--random needs --out: a random crowd does not ship")
    people = [person for person in PEOPLE if not chosen.names or person.name in chosen.names]
    unknown = set(chosen.names) - {person.name for person in people}
    if unknown:
        parser.error(f"there is no worker {', '.join(sorted(unknown))}")
    chosen.out.mkdir(parents=True, exist_ok=True)
    if chosen.random:
        crowd = (random_person(number, chosen.seed) for number in range(chosen.random))
        # The .npz is written last: a worker that has one is complete.
        people = [person for person in crowd if not (chosen.out / f"{person.name}.npz").exists()]
    start, total = time.perf_counter(), 0
    # A new process for each, so that a worker's files do not depend on earlier workers.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(chosen.jobs, mp_context=context, max_tasks_per_child=1) as pool:
        made = pool.map(make, people, [chosen.out] * len(people))
        for person, size in zip(people, made, strict=True):
            total += size
            print(f"{person.name:10s} {size / 1e3:6.0f} kB  {time.perf_counter() - start:5.0f} s")
    print(f"{len(people)} workers, {total / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
