"""The command ``awarenav demo``."""

from __future__ import annotations

from pathlib import Path

from awarenav.cli import POSITIVE, OneOf, command, option, options
from awarenav.files import require_writable


@command(
    "demo",
    examples=[
        "awarenav demo --out demo",
        "awarenav demo --seeds 10 --out ten",
        "awarenav demo --paper --no-video --out paper",
    ],
    exit_status={0: "Success.", 2: "Bad input, or the extra 'sim' is missing."},
    epilog="Needs the extra 'sim'.",
)
@options.out_folder("demo")
@option("--no-video", is_flag=True, help="Write no film (faster).")
@option(
    "--seeds",
    type=POSITIVE,
    metavar="N",
    help="Run the seeds 0 to N-1 without a film, and print their table; 10 of them take minutes.",
    excludes="--paper",
)
@option("--paper", is_flag=True, help="Run the paper's 25 s encounter instead.")
@option(
    "--perception",
    type=OneOf(["keypoints", "pixels"]),
    default="keypoints",
    help="With --paper: noisy keypoints, or networks that see rendered images (many minutes).",
)
@options.seed(default=None)
@options.as_json()
def demo(
    out: Path,
    *,
    no_video: bool,
    seeds: int | None,
    paper: bool,
    perception: str,
    seed: int | None,
    as_json: bool,
) -> int:
    """Film four robots in an aisle in which somebody with a phone steps out.

    Today's AMR with a planner that knows how people walk, today's AMR with a costmap planner, a
    robot that is slow for everybody, and awarenav. Prints their figures beside those of ten seeds.
    Writes lanes.jsonl, crossing.webp and crossing.mp4; with --paper encounter.png, encounter.mp4
    and encounter.csv.
    """
    # Help needs no simulator; without it, nothing else is missing first.
    from ..world.bullet import require_pybullet  # noqa: PLC0415

    require_pybullet()
    require_writable(out)
    from . import _demo  # noqa: PLC0415

    if paper:
        _demo.run_paper(
            out, seed=seed or 0, video=not no_video, perception=perception, as_json=as_json
        )
    elif seeds is not None:
        _demo.run_seeds(out, seeds=seeds, as_json=as_json)
    else:
        _demo.run_demo(out, seed=seed, video=not no_video, as_json=as_json)
    return 0
