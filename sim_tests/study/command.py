"""The commands of studies, from ``awarenav crossings`` to ``awarenav export``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from awarenav.cli import (
    POSITIVE,
    FilePath,
    FolderPath,
    Number,
    OneOf,
    Whole,
    argument,
    command,
    group,
    option,
    options,
)

from ..conditions import COMPLETE_SCENARIOS, USUAL_SENSORS, Experiment, conditions_options

#: Names of the formats of exported episodes; those of ``_files.FORMATS``.
FORMAT_NAMES = ("socnav3", "navwareset")
_FIRST_SEED = {"note": " It is that of the first episode; the next ones count up."}
_EPISODE = (
    "The number of the episode in episodes.csv, from 0; or SCENARIO:SEED:POLICY, followed by "
    ":PLANNER and :FAULT if the run has several"
)


def _require_simulator() -> None:
    """Say that PyBullet is missing, before anything else that comes with it is missed."""
    from ..world.bullet import require_pybullet  # noqa: PLC0415 - help needs no simulator

    require_pybullet()


@command(
    "crossings",
    examples=[
        "awarenav crossings --out results    # all 23 scenarios, about 4 minutes of processor time",
        "awarenav crossings --scenario blind_corner --policy blind balanced",
        "awarenav crossings --policy mine.yaml blind --episodes 20 --out run",
        "awarenav crossings --planner my_planners:Dwa reference --fault none ghosts",
        "awarenav crossings --population classic recorded --perception truth --out people",
        "awarenav crossings --robot forklift --scenario blind_corner head_on_in_aisle",
        "awarenav crossings --fault 'scanner_*' --sample 50",
    ],
    exit_status={
        0: "Success.",
        1: "Some episodes failed; DIR/errors.log has the tracebacks.",
        2: "Bad input; nothing was run.",
        130: "Interrupted; the episodes so far are kept.",
    },
    epilog="A killed or interrupted run continues with the same command and --resume. `awarenav "
    "replay DIR N` films episode N; `awarenav compare DIR` prints more tables.",
)
@conditions_options(
    many=("scenario", "policy", "planner", "sensors", "population", "fault"),
    policy={"default": ["scanner", "blind", "balanced"]},
    sensors=USUAL_SENSORS,
    seed=_FIRST_SEED,
)
@option("--episodes", type=POSITIVE, default=1, metavar="N", help="Number of seeds per scenario.")
@option(
    "--sample",
    type=POSITIVE,
    show_default="all",
    metavar="N",
    help="Run only N of all these episodes, drawn at random by --seed: each fault once before any "
    "twice, scenarios and policies equally often.",
)
@options.workers()
@option(
    "--scheduler",
    metavar="ADDRESS",
    help="Run on a Dask cluster: tcp://HOST:PORT, or 'local' for a cluster of --workers processes "
    "on this computer.",
)
@option(
    "--time-limit",
    type=Number(1.0),
    show_default="none",
    metavar="S",
    help="End an episode that takes longer than this in real time, for example because its planner "
    "hangs.",
)
@options.out_folder("crossings")
@options.resume()
@options.overwrite()
@option("--no-report", is_flag=True, help="Write no report.")
@options.as_json()
def crossings(**values: Any) -> int:
    """Run every scenario, policy, planner, population and fault on the same seeds, in closed loop.

    Every episode that ends writes a file into DIR/episodes. At the end, and when the run is
    interrupted, their table episodes.csv is written, and at the end the report. The row of a failed
    episode has the reason; the other episodes still run.
    """
    _require_simulator()
    from ._commands import crossings_command  # noqa: PLC0415 - help needs no simulator

    return crossings_command(Experiment.taken_from(values), **values)


@command(
    "replay",
    examples=[
        "awarenav replay run 12",
        "awarenav replay run blind_corner:3:balanced --no-video",
        "awarenav replay run 12 --view",
        "awarenav replay run all --view",
    ],
    exit_status={
        0: "The episode gives the same row as before.",
        1: "The episode gives another row.",
        2: "Bad input.",
    },
)
@argument("folder", type=FolderPath(), metavar="DIR", help="Folder of `awarenav crossings --out`.")
@argument("episode", help=f"{_EPISODE}; or 'all'.")
@options.out_folder(
    None, "Folder of the video and the map, or of the page.", show_default="DIR/replays"
)
@option("--no-video", is_flag=True, help="Draw only the map (faster).")
@option(
    "--view",
    is_flag=True,
    excludes="--no-video",
    help="Write a page for the browser instead of video and map, and open it if there is a "
    "display. The report links to it.",
)
def replay(**values: Any) -> int:
    """Run one episode of a run again, film it and draw it from above, or write its page.

    Prints whether the episode gives the same row as before.
    """
    _require_simulator()
    from .runs import replay_command  # noqa: PLC0415 - help needs no simulator

    return replay_command(**values)


@command(
    "watch",
    examples=[
        "awarenav watch crossing_attentive",
        "awarenav watch blind_corner --seed 3 --policy blind",
        "awarenav watch late_glance --population recorded --robot delivery",
        "awarenav watch late_glance --port 8765 --wait 300 --out late_glance.html",
    ],
    exit_status={
        0: "The crossing has ended, whatever its outcome.",
        2: "Bad input; nothing was run.",
        130: "Interrupted.",
    },
    epilog="The page is served only on this computer and makes no requests to any other. It "
    "keeps all states after the end, so the crossing can then be scrubbed.",
)
@argument(
    "scenario",
    metavar="SCENARIO",
    shell_complete=COMPLETE_SCENARIOS,
    help="A shipped scenario, or a YAML file.",
)
@conditions_options(without=("scenario",), sensors=USUAL_SENSORS)
@option(
    "--speed",
    type=Number(0.1, 20.0),
    default=1.0,
    metavar="X",
    help="Simulated seconds per second. A slower computer runs at its own pace.",
)
@option(
    "--port",
    type=Whole(0, 65535),
    default=0,
    show_default="any free one",
    metavar="N",
    help="Port of the page on 127.0.0.1.",
)
@option(
    "--wait",
    type=Number(0.0, 3600.0),
    default=30.0,
    metavar="S",
    help="Longest time to wait for somebody to open the page before the crossing starts.",
)
@option(
    "--out",
    type=FilePath(),
    show_default="none",
    metavar="FILE.html",
    help="Also write the crossing as a page that needs no server.",
)
@option("--no-camera", is_flag=True, help="Show no picture of the robot's camera (faster).")
@option("--no-browser", is_flag=True, help="Open no browser; print the address only.")
def watch(**values: Any) -> int:
    """Watch one crossing in the browser while it runs.

    Shows the hall from above and the robot's camera, with attention cones, tracks, scans and radii;
    and over time each person's α with its bound, the speed limit and what sets it.
    """
    _require_simulator()
    from ._commands import watch_command  # noqa: PLC0415 - help needs no simulator

    return watch_command(Experiment.taken_from(values), **values)


@command(
    "compare",
    examples=[
        "awarenav compare crossings",
        "awarenav compare monday tuesday --baseline balanced --out both.csv",
    ],
    exit_status={0: "Success.", 2: "Bad input."},
    epilog="docs/measures.md defines every metric.",
)
@argument(
    "runs",
    nargs=-1,
    required=True,
    type=FilePath(),
    metavar="DIR|FILE...",
    help="Folders of runs, or files episodes.csv or .parquet.",
)
@option("--baseline", default="blind", metavar="NAME", help="Policy to compare with.")
@option(
    "--level",
    type=Number(0.0, 1.0, min_open=True, max_open=True),
    default=0.95,
    metavar="X",
    help="Confidence level of the intervals, between 0 and 1.",
)
@options.seed(" They are those of the bootstrap.")
@options.out_file(None, "Also write the episodes of all runs into one file.", "FILE.csv|parquet")
@options.as_json("the summary")
def compare(**values: Any) -> int:
    """Print success, time lost, contacts and separation per policy, with confidence intervals.

    Compares every policy with the baseline on the same scenarios and seeds. A run may be
    unfinished.
    """
    from ._compare import compare_command  # noqa: PLC0415 - help needs no statistics

    return compare_command(**values)


@command(
    "frontier",
    examples=[
        "awarenav frontier --episodes 4 --sensors camera+scanner --out frontier",
        "awarenav frontier frontier",
        "awarenav frontier --scenario blind_corner --scenario runs_out --perception truth",
    ],
    exit_status={
        0: "Success.",
        1: "Some episodes failed; DIR/errors.log has the tracebacks.",
        2: "Bad input; nothing was run.",
        130: "Interrupted; the episodes so far are kept.",
    },
    epilog="A killed or interrupted run continues with the same command and --resume. "
    "docs/what_it_wins.md explains the picture.",
)
@argument(
    "folder",
    type=FolderPath(),
    required=False,
    metavar="[DIR]",
    help="Folder of finished episodes, to draw them again; nothing is run.",
)
@conditions_options(
    many=("scenario",), repeated=True, without=("policy", "fault"), seed=_FIRST_SEED
)
@option("--episodes", type=POSITIVE, default=1, metavar="N", help="Number of seeds per scenario.")
@options.workers()
@options.out_folder("frontier")
@options.resume()
@options.overwrite()
@options.as_json("the frontier")
def frontier(**values: Any) -> int:
    """Show what awareness is worth: time lost over step-out impacts.

    Runs `balanced` with other speeds U of unaware people, each without awareness, with it, and,
    with laser scanners, with a memory of 3 s; and today's AMR, the policy `scanner`. Writes
    frontier.png, frontier.svg, frontier.md and frontier.json, and the policies into DIR/policies.
    They say what awareness wins at equal risk and at equal time, with 95 % intervals. With DIR,
    the folder of such episodes, it runs nothing and draws them again.
    """
    from .frontier import frontier_command  # noqa: PLC0415 - help needs no simulator

    return frontier_command(experiment=Experiment.taken_from(values), **values)


@command(
    "measures",
    examples=[
        "awarenav measures crossings",
        "awarenav measures crossings --workers 2 --out social.csv",
        "awarenav measures track_scene1_col1.csv",
    ],
    exit_status={0: "Success.", 1: "An episode failed with an error.", 2: "Bad input."},
    epilog="docs/social_measures.md defines every measure and names its source. The episodes of a "
    "run are run again, which takes as long as the run. Needs the extra 'bench'.",
)
@argument(
    "sources",
    nargs=-1,
    required=True,
    type=FilePath(),
    metavar="DIR|FILE.csv...",
    help="Folders of runs, or tracks with the columns of NavWareSet.",
)
@options.workers()
@options.out_file(
    None, "Table with a row for each episode.", "FILE.csv", show_default="DIR/social.csv of one run"
)
@options.as_json("the means")
def measures(
    sources: tuple[Path, ...], workers: int | None, out: Path | None, as_json: bool
) -> int:
    """Measure episodes as other projects do: HuNavSim, SocNavGym, NavWareSet.

    Prints SPL, STL, distances, zones, accelerations, social work and more: the mean over the
    episodes of each policy.
    """
    from .social import measure_sources  # noqa: PLC0415 - help needs no runs

    return measure_sources(sources, workers=workers, out=out, as_json=as_json)


@group("export")
def export() -> None:
    """Write episodes in the formats of other projects."""


@command(
    "episode",
    short_help="Write one episode of a run.",
    examples=[
        "awarenav export episode run 12",
        "awarenav export episode run blind_corner:3:balanced --format navwareset",
    ],
    exit_status={0: "Success.", 2: "Bad input; nothing was written."},
    epilog="docs/social_measures.md describes the formats.",
)
@argument("folder", type=FolderPath(), metavar="DIR", help="Folder of `awarenav crossings --out`.")
@argument("episode", help=f"{_EPISODE}.")
@option(
    "--format",
    type=OneOf(FORMAT_NAMES),
    default=None,
    show_default="that of --out, or socnav3",
    help="Format of the file.",
)
@options.out_file(None, "The file.", "FILE.json|csv", show_default="DIR/exports/episode_NUMBER")
def export_episode(**values: Any) -> int:
    """Run one episode of a run again and write the paths of robot and people.

    The formats are the JSON of SocNav3 and the CSV columns of NavWareSet.
    """
    from .social import export_episode as export_to_file  # noqa: PLC0415 - help needs no runs

    return export_to_file(**values)


export.add_command(export_episode)
