"""Command ``python -m benchmarks.people``: compare simulated people with recorded ones.

With ``--summary`` it only summarises recordings into a file.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from awarenav.baseline import MeasuredValue
from awarenav.errors import AwarenavError
from sim_tests.actors.behaviour import POPULATIONS

from .._harness import add_seed, bad_input, count, finish, make_parser, parse
from ._comparison import (
    compare,
    compare_eyes,
    displacement_table,
    draw,
    looked_table,
    start_table,
    table,
)
from ._crowd import LAYOUTS, simulate
from ._distribution import RECORDED, read_recorded, summarise, write_recorded
from ._motion import read_scene
from ._standing import displacements, eye_yaw_deg, looked_within, starts

_BASELINE: Final = Path(__file__).with_name("baseline.json")
_SOURCE: Final = (
    "Six clips of CITR (Yang, Li, Redmill and Özgüner 2019, Top-view Trajectories: A Pedestrian "
    "Dataset of Vehicle-Crowd Interaction from Controlled Experiments and Crowded Campus, IEEE "
    "Intelligent Vehicles Symposium): p2p_bi_bidirection_no_vehicle 3v7_01 and 5v5_01, "
    "vci_front_front_interaction_01, vci_lat_bi_bidirection_normal_driving 04 and 05, "
    "vci_lat_uni_unidirection_yeild_01"
)
# The goal belongs to the fitted population.
_FITTED: Final = "recorded"
_PLOTS: Final = {
    "people_walking.png": (
        "speed_alone",
        "speed_vehicle",
        "along",
        "across",
        "turning",
        "heading_change",
    ),
    "people_crowd.png": (
        "speed_change",
        "deviation_1s",
        "deviation_2s",
        "nearest",
        "closest",
        "sway",
    ),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit status."""
    parser = make_parser("benchmarks.people", __doc__ or "", _BASELINE)
    parser.add_argument(
        "--recordings", type=Path, metavar="DIR", help="clips, CSV files of t_s, id, x_m, y_m"
    )
    parser.add_argument(
        "--summary", type=Path, metavar="FILE", help="only summarise --recordings into this file"
    )
    parser.add_argument(
        "--population", nargs="+", choices=POPULATIONS, default=list(POPULATIONS), metavar="NAME"
    )
    parser.add_argument(
        "--crowds", type=count, default=4, metavar="N", help="crowds of each layout (default: 4)"
    )
    parser.add_argument(
        "--people", type=count, default=229, metavar="N", help="standing people (default: 229)"
    )
    parser.add_argument("--plots", type=Path, metavar="DIR", help="draw distributions there")
    add_seed(parser)
    options, baseline = parse(parser, arguments)
    try:
        if options.summary is not None:
            if options.recordings is None:
                parser.error("--summary needs --recordings")
            clips = sorted(options.recordings.glob("*.csv"))
            if not clips:
                parser.error(f"--recordings holds no CSV file, got {options.recordings}")
            write_recorded(
                options.summary, summarise([read_scene(clip) for clip in clips], _SOURCE)
            )
            return 0
        known = read_recorded(RECORDED)
    except AwarenavError as error:
        return bad_input(parser, error)

    scenes = {
        people: [
            simulate(layout, 1000 * options.seed + 10 * number + row, people)
            for number in range(options.crowds)
            for row, layout in enumerate(LAYOUTS)
        ]
        for people in options.population
    }
    rows = compare(known, scenes)
    eyes = {each: eye_yaw_deg(each, seed=options.seed) for each in options.population}
    rows.append(compare_eyes(eyes))
    print("Crowds in the layout of the recordings: 50th, 95th and 99th percentile\n")
    print(table(rows), flush=True)
    standing = {
        each: displacements(each, options.people, options.seed) for each in options.population
    }
    print("\nDisplacement after standing: 99th percentile, maximum\n")
    print(displacement_table(standing), flush=True)
    begun = {
        each: {
            robot: starts(
                each, yielding=robot == "yielding", count=options.people, seed=options.seed
            )
            for robot in ("yielding", "moving")
        }
        for each in options.population
    }
    print("\nShare of standing people who start within 1 s\n")
    print(start_table(begun), flush=True)
    looked = {
        each: looked_within(each, options.people, options.seed) for each in options.population
    }
    print("\nShare of people who had looked before crossing\n")
    print(looked_table(looked), flush=True)
    if options.plots is not None:
        options.plots.mkdir(parents=True, exist_ok=True)
        for name, quantities in _PLOTS.items():
            draw(known, scenes, options.plots / name, quantities)
    metrics, missed = [], []
    for row in rows:
        if _FITTED in row.distance:
            distance = row.distance[_FITTED]
            metrics.append(MeasuredValue(f"{row.name} KS", distance, "1", "lower", 0.3))
            if distance > row.within_chance:
                missed.append(f"{row.name}: KS {distance:.3f}, goal {row.within_chance:.3f}")
    return finish(metrics, missed, baseline, options.out)


if __name__ == "__main__":
    raise SystemExit(main())
