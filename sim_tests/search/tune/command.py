"""The command ``awarenav tune``."""

from __future__ import annotations

from typing import Any

from awarenav.cli import POSITIVE, FilePath, OneOf, command, option, options


@command(
    "tune",
    epilog="Killed or interrupted, the same command with --resume ends with the same study; run in "
    "several terminals at once, they share the trials. Exit status: 0 success; 2 bad input. Needs "
    "the extra 'bench'.",
)
@options.policy()
@options.scenarios("that have a planner")
@option(
    "--ranges",
    type=FilePath(),
    metavar="FILE",
    help="YAML of the parameters to search and their ranges (default: the shipped ranges).",
)
@option("--trials", type=POSITIVE, default=60, metavar="N", help="Policies to try.")
@option(
    "--episodes",
    type=POSITIVE,
    default=5,
    metavar="N",
    help="Tuning seeds, each run in every scenario.",
)
@option(
    "--held-out",
    type=POSITIVE,
    default=10,
    metavar="N",
    help="Held-out seeds for presets and chosen policies.",
)
@option(
    "--generation",
    type=POSITIVE,
    default=6,
    metavar="N",
    help="Trials proposed together; as many processes can share the work.",
)
@option(
    "--sampler",
    type=OneOf(["tpe", "nsga2"]),
    default="tpe",
    help="tpe for up to some hundred trials; nsga2 for more, with a --generation of about 20.",
)
@options.perception()
@options.camera()
@options.planner()
@options.seed()
@options.workers(1)
@options.out_folder("tune")
@options.resume()
@options.as_json()
def tune(**values: Any) -> int:
    """Search the numbers of a policy for little time lost and little margin violated.

    Trials with a contact that the robot caused are not chosen. Writes study.db, trials.csv,
    pareto.png, importances.json, chosen.json, and chosen/*.yaml with their figures on held-out
    seeds.
    """
    from ._run import TuneOptions, tune_command  # noqa: PLC0415 - help needs no simulator

    return tune_command(TuneOptions(**values))
