"""Command ``python -m training.legs``: make the classifier of legs in laser scans.

The stages are scans of random halls, the training, and the export. Each continues where it was
interrupted.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

from ..manifest import update_manifest
from ._net import export
from ._train import Recipe, deviation_factors, joined, make_shard, read_shard, train

_ROOT: Final = Path(__file__).parents[2]
_MODELS: Final = _ROOT / "perception" / "models"
_ENTRY: Final = {
    "name": "leg_classifier",
    "licence": "Apache-2.0",
    "input": "(H, 79) features of clusters in a laser scan, see perception.laser",
    "summary": "Judges clusters and pairs of clusters in laser scans: a person, and where. Made "
    "for the simulator.",
    "training_domain": "simulated scans",
}


def main() -> None:
    """Run all stages."""
    parser = argparse.ArgumentParser(prog="python -m training.legs", description=__doc__)
    parser.add_argument("--work", type=Path, default=_ROOT / "build" / "legs")
    parser.add_argument("--out", type=Path, default=_MODELS, help="folder of the network")
    parser.add_argument("--seed", type=int, default=0, help="default: %(default)s")
    parser.add_argument("--processes", type=int, default=2, help="processes that scan")
    parser.add_argument("--quick", action="store_true", help="a tiny run that checks every stage")
    chosen = parser.parse_args()
    if chosen.quick and chosen.out == _MODELS:
        parser.error("--quick needs --out: its network is useless and must not ship")
    recipe = replace(Recipe(), seed=chosen.seed)
    recipe = recipe.quick() if chosen.quick else recipe
    work: Path = chosen.work
    work.mkdir(parents=True, exist_ok=True)
    chosen.out.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(chosen.processes) as pool:
        make = partial(make_shard, recipe, work)
        shards = list(pool.map(partial(make, check=False), range(recipe.halls)))
        checks = list(pool.map(partial(make, check=True), range(recipe.check_halls)))
        samples = joined(list(pool.map(read_shard, shards)))
        check = joined(list(pool.map(read_shard, checks)))
    print(f"{len(samples.person)} hypotheses, {samples.person.sum():.0f} of people")
    weights = train(recipe, samples, check, work)
    factors = deviation_factors(weights, check)
    print("factors on the standard deviations:", factors.round(3).tolist())
    export(weights, factors, chosen.out / "leg_classifier.onnx")
    print("written", update_manifest(chosen.out, [_ENTRY]))


if __name__ == "__main__":
    main()
