"""The command ``awarenav scenario``."""

from __future__ import annotations

import shlex
from pathlib import Path

from awarenav.cli import NUMBER, FilePath, Whole, argument, command, group, option, options

from ...conditions import COMPLETE_SCENARIOS, SETS_TEXT


@group("scenario")
def scenario() -> None:
    """List, explain, draw and check scenarios: shipped ones, or your own YAML files."""


@command(
    "list",
    short_help="List the shipped scenarios.",
    examples=["awarenav scenario list --json"],
    exit_status={0: "Success."},
)
@options.as_json("the list")
def list_scenarios(*, as_json: bool) -> int:
    """List the shipped scenarios, set by set.

    Shows name and version, whether the people notice the robot, the number of people, the number of
    values that vary, and what happens.
    """
    from ...scenario.catalogue import list_command  # noqa: PLC0415 - help needs no scenarios

    return list_command(as_json=as_json)


@command(
    "show",
    short_help="Describe a scenario, draw it, or print it as YAML.",
    examples=[
        "awarenav scenario show blind_corner --out corner.png",
        "awarenav scenario show crossing_from_left --yaml > mine.yaml",
    ],
    exit_status={0: "Success.", 2: "Bad input."},
)
@argument(
    "scenario",
    metavar="NAME|FILE",
    shell_complete=COMPLETE_SCENARIOS,
    help="A shipped scenario, or a YAML file.",
)
@option("--yaml", is_flag=True, help="Print YAML instead, with the shared defaults written out.")
@options.seed(" With --yaml: print the scenario of the episode with this seed.", default=None)
@options.out_file(None, "Also draw the scenario from above.", "FILE.png|svg|pdf")
def show(scenario: str, *, yaml: bool, seed: int | None, out: Path | None) -> int:
    """Describe what happens in a scenario and what varies.

    Also prints how often robot and people would meet if nobody reacted. The drawing shows the hall,
    paths with dots every 2 s, and gaze. Values that vary are at their medians; thin lines are the
    paths of other episodes. Robot and people are drawn 1.5 s before their closest approach.
    """
    from ...scenario.catalogue import show_command  # noqa: PLC0415 - help needs no scenarios

    status = show_command(scenario, yaml=yaml, seed=seed)
    if out is not None and not yaml:
        from ...scenario.drawing import draw_scenario  # noqa: PLC0415 - slow

        draw_scenario(scenario, out)
    return status


@command(
    "validate",
    short_help="Check scenario files.",
    examples=["awarenav scenario validate mine.yaml"],
    exit_status={
        0: "All can be run.",
        1: "The people of a scenario contradict its attention.",
        2: "A scenario cannot be run.",
    },
)
@argument(
    "files",
    nargs=-1,
    required=True,
    metavar="NAME|FILE...",
    shell_complete=COMPLETE_SCENARIOS,
    help=f"YAML files, shipped scenarios, or a set of these: {SETS_TEXT}.",
)
@option(
    "--episodes",
    type=Whole(0),
    default=3,
    metavar="N",
    help="Crossings per scenario that measure what its people look at; 0 measures nothing.",
)
def validate(files: tuple[str, ...], *, episodes: int) -> int:
    """Check scenario files: keys, values over many draws, and that nobody stands in a rack.

    Runs a few crossings with perfect perception and checks `attention` against what people look
    at while the robot is in front of them within 5 m: `attentive` people have looked at it within
    1 s for at least 80 % of that time, `unaware` people look at it for at most 25 %.
    Also warns if robot and people would hardly ever meet if nobody reacted.
    """
    from ._validate import validate_command  # noqa: PLC0415 - help needs no scenarios

    return validate_command(files, episodes)


@command(
    "from-recording",
    short_help="Make a scenario from recorded people.",
    examples=[
        "awarenav scenario from-recording people.csv --out hall.yaml",
        "awarenav scenario from-recording people.csv --robot-id agv --react --out hall.yaml",
    ],
    exit_status={0: "Success.", 2: "Bad input; nothing was written."},
)
@argument(
    "table",
    metavar="FILE.csv",
    type=FilePath(),
    help="Positions of people, with the columns t_s, id, x_m, y_m and optionally heading_rad.",
)
@option(
    "--react",
    is_flag=True,
    help="People leave their paths where the robot forces them off, and return.",
)
@option(
    "--robot-id",
    metavar="ID",
    help="The id of the robot's rows: they are not a person, and give the task.",
)
@option("--start", nargs=2, type=NUMBER, metavar="X Y", help="Start of the robot, in metres.")
@option("--goal", nargs=2, type=NUMBER, metavar="X Y", help="Goal of the robot, in metres.")
@option(
    "--from-s",
    type=NUMBER,
    metavar="S",
    show_default="the robot's first row, or the first",
    help="Time of the recording at which the episode begins.",
)
@option("--until-s", type=NUMBER, metavar="S", help="Leave later rows out.")
@options.out_file("recording.yaml", "The scenario; people go to a CSV beside it.", "FILE.yaml")
def from_recording(
    table: Path,
    *,
    react: bool,
    robot_id: str | None,
    start: tuple[float, float] | None,
    goal: tuple[float, float] | None,
    from_s: float | None,
    until_s: float | None,
    out: Path,
) -> int:
    """Make a scenario from recorded people: the robot drives in closed loop among them.

    The recorded people do not react to the robot, or with --react leave their paths where it
    forces them off. Positions stay as recorded. Without --robot-id, --start and --goal the robot
    drives along the longer side of the floor.
    """
    from ...scenario.recordings import RecordingOptions, scenario_from_recording  # noqa: PLC0415 - help needs no scenarios

    chosen = RecordingOptions(react, robot_id, start, goal, from_s, until_s)
    made = scenario_from_recording(table, out, chosen)
    print("\n".join(made.remarks))
    print(f"\nWritten: {made.scenario} and {made.people}. Run it:")
    print(f"  awarenav crossings --scenario {shlex.quote(str(made.scenario))} --perception truth")
    return 0


for _command in (list_scenarios, show, validate, from_recording):
    scenario.add_command(_command)
