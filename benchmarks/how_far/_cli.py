"""The tables of the command line."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Final, get_args

import numpy as np

from sim_tests.world import Warehouse
from sim_tests.world.hall import WarehouseLayout

from ._people import STATURES_M, Cues, Cut, HowFar, Posture, Result, cases
from ._tracks import tracked

#: 95 % of a normal error of three dimensions lie within this squared Mahalanobis distance.
BOUND_95: Final = 7.81
#: The same on the floor plane.
BOUND_2D_95: Final = 5.99


def _tracked_rows(far: HowFar, count: int, seed: int) -> Iterator[str]:
    for posture in get_args(Posture):
        people = [
            case
            for one in STATURES_M
            for case in cases(one, posture, "whole", count=count, seed=seed)
        ]
        with_scans = [tracked(far, case) for case in people]
        alone = [tracked(far, case, scanner=False) for case in people]
        cells = [
            _cell([one for part in group for one in part], BOUND_2D_95)
            for group in (
                [each.lost for each in alone],
                [each.ranged for each in with_scans],
                [each.lost for each in with_scans],
            )
        ]
        yield f"| {posture} | " + " | ".join(cells) + " |"


def _rows(far: HowFar, count: int, seed: int, chosen: list[Cues]) -> Iterator[str]:
    kinds: list[tuple[Posture, Cut, bool]] = [
        *((posture, "whole", True) for posture in get_args(Posture)),
        *(
            (posture, cut, True)
            for posture in ("standing", "seated")
            for cut in ("shelf", "border")
        ),
        ("standing", "whole", False),
        ("seated", "whole", False),
        ("standing", "shelf", False),
        ("standing", "border", False),
    ]
    for posture, cut, skeleton in kinds:
        groups = [(f"{one:g} m", (one,)) for one in STATURES_M] if cut == "whole" else []
        for name, statures in [*groups, ("all", STATURES_M)]:
            if not skeleton and name != "all":
                continue
            cells = []
            for cues in chosen:
                people = [
                    case
                    for one in statures
                    for case in cases(one, posture, cut, skeleton=skeleton, count=count, seed=seed)
                ]
                cells.append(_cell(far.results(people, cues)))
            who = f"{posture}, {cut}" + ("" if skeleton else ", box alone")
            yield f"| {who} | {name} | " + " | ".join(cells) + " |"


def _cell(results: list[Result], bound: float = BOUND_95) -> str:
    off = np.abs([one.range_error for one in results])
    inside = np.mean([one.mahalanobis2 <= bound for one in results])
    std = np.median([one.range_std for one in results])
    return (
        f"{100 * np.median(off):.0f} %, {100 * np.quantile(off, 0.9):.0f} % | "
        f"{100 * std:.0f} % | {100 * inside:.0f} %"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.how_far")
    parser.add_argument("--count", type=int, default=24, help="people of each stature and kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--tracks", type=int, default=2, help="walks of each stature and posture")
    parser.add_argument("--cues", nargs="*", default=list(get_args(Cues)))
    chosen = parser.parse_args()
    print("Error of the range: median, 90 %; its reported σ; share within the 95 % bound.\n")
    print("| who | stature | camera alone | σ | in | floor | σ | in | depth | σ | in |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    with Warehouse(WarehouseLayout.named("open")) as warehouse:
        for row in _rows(HowFar(warehouse), chosen.count, chosen.seed, chosen.cues):
            print(row, flush=True)
        if chosen.tracks:
            print("\n| track | camera alone | σ | in | with scans | σ | in | then lost | σ | in |")
            print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
            for row in _tracked_rows(HowFar(warehouse), chosen.tracks, chosen.seed):
                print(row, flush=True)
