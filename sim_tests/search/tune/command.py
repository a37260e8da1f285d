"""The command ``awarenav tune``."""

from __future__ import annotations

from typing import Any

from awarenav.cli import POSITIVE, FilePath, Number, OneOf, command, option, options

from ...conditions import Experiment, conditions_options


@command(
    "tune",
    examples=[
        "awarenav tune --trials 200 --workers 8 --out tuning",
        "awarenav tune --policy mine.yaml --ranges ranges.yaml --scenario blind_corner",
    ],
    exit_status={
        0: "Success.",
        2: "Bad input.",
        130: "Interrupted; the trials so far are kept.",
    },
    epilog="A killed or interrupted study continues with the same command and --resume, and ends "
    "with the same result; --trials and --held-out may be raised then. Several processes that run "
    "the command with the same --out share the trials. Needs the extra 'bench'.",
)
@conditions_options(many=("scenario",), without=("fault",))
@option(
    "--ranges",
    type=FilePath(),
    metavar="FILE",
    show_default="the shipped ranges",
    help="Parameters to search, and their ranges (YAML).",
)
@option("--trials", type=POSITIVE, default=60, metavar="N", help="Number of policies to try.")
@option(
    "--episodes",
    type=POSITIVE,
    default=5,
    metavar="N",
    help="Tuning seeds; a trial runs each of them in every tuning scenario, unless it loses to "
    "--policy before.",
)
@option(
    "--held-out",
    type=POSITIVE,
    default=10,
    metavar="N",
    help="Held-out seeds, on which the presets and the chosen policies are compared.",
)
@option(
    "--generation",
    type=POSITIVE,
    default=6,
    metavar="N",
    help="Trials that are proposed together; so many processes can work at once.",
)
@option(
    "--sampler",
    type=OneOf(["tpe", "nsga2"]),
    default="tpe",
    help="Search method: tpe for up to a few hundred trials, nsga2 for more (with a --generation "
    "of about 20).",
)
@option(
    "--risk",
    type=Number(0.0),
    show_default="a twentieth of that of today's AMR in the same episodes",
    metavar="N",
    help="Step-out impacts with unaware people that a policy may have, per 1 000 crossings.",
)
@option(
    "--requests",
    type=Number(0.0),
    show_default="no bound",
    metavar="N",
    help="Requests for attention that a policy may make per crossing.",
)
@options.workers(1)
@options.out_folder("tune")
@options.resume()
@options.overwrite()
@options.as_json()
def tune(**values: Any) -> int:
    """Search for the policy that loses the least time at a given risk.

    Varies the numbers of --policy. The risk is that of step-outs: impacts with unaware people who
    set off at any time. Trials run few episodes first, and end when an interval shows that they
    are above the risk or lose to --policy. A policy with which a moving robot and a person touched
    is not chosen. Ends with a verdict against --policy on held-out seeds and on every third
    scenario, which no trial runs, and the next command. Writes study.log, trials.csv, tuning.png,
    importances.json, chosen.json, and chosen/*.yaml with their results on the held-out seeds.
    """
    from ._results import run_tune  # noqa: PLC0415 - help needs no simulator

    seeds = values.pop("episodes")
    return run_tune(experiment=Experiment.taken_from(values), episodes=seeds, **values)
