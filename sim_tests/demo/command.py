"""The command ``awarenav demo``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from awarenav.cli import OneOf, command, option, options

from ..conditions import Experiment, conditions_options


@command(
    "demo",
    examples=[
        "awarenav demo --out demo",
        "awarenav demo --robot omni --population recorded --no-video --out omni",
    ],
    exit_status={0: "Success.", 2: "Bad input, or the extra 'sim' is missing."},
    epilog="Needs the extra 'sim'. The encounter keeps the paper's robot and worker.",
)
@options.out_folder("demo")
@option("--no-video", is_flag=True, help="Write no films (faster).")
@conditions_options(
    without=("scenario", "policy", "planner", "sensors", "camera", "networks", "fault"),
    perception={"type": OneOf(["keypoints", "pixels"]), "note": " 'pixels' takes many minutes."},
)
@options.as_json("the tables")
def demo(
    out: Path,
    *,
    no_video: bool,
    as_json: bool,
    **values: Any,
) -> int:
    """Run the paper's 25 s encounter, and one crossing with and without awareness.

    Prints the results. Writes encounter.png, encounter.mp4 and encounter.csv; crossings.png and
    episodes.csv; and a film of the crossing with three robots: crossing.webp and crossing.mp4.
    """
    from ._demo import run_demo  # noqa: PLC0415 - help needs no simulator

    experiment = Experiment.taken_from(values)
    run_demo(
        out,
        seed=experiment["seed"],
        video=not no_video,
        perception=experiment["perception"],
        axes=experiment.changes,
        as_json=as_json,
    )
    return 0
