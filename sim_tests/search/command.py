"""The commands ``awarenav tune`` and ``awarenav falsify``."""

from __future__ import annotations

from typing import Any

from awarenav.cli import POSITIVE, FilePath, Number, OneOf, command, option, options

from ..conditions import COMPLETE_SIMULATED_POLICIES, SETS_TEXT, Experiment, conditions_options


@command(
    "tune",
    examples=[
        "awarenav tune --trials 200 --workers 8 --out tuning",
        "awarenav tune --policy mine.yaml --ranges ranges.yaml --scenario blind_corner",
    ],
    exit_status={0: "Success.", 2: "Bad input.", 130: "Interrupted; the trials so far are kept."},
    epilog="A killed or interrupted study continues with the same command and --resume, and ends "
    "with the same result; --trials and --held-out may be raised then. Needs the extra 'bench'.",
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
    "--generation", type=POSITIVE, default=6, metavar="N", help="Trials that are proposed together."
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
    help="Step-out impacts with people who do not look that a policy may have, per 1 000 "
    "crossings.",
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

    Varies the numbers of --policy. The risk is that of step-outs: impacts with people who do not
    look and set off at any time. Trials run few episodes first, and end when an interval shows that
    they are above the risk or lose to --policy. A policy with which a moving robot and a person
    touched is not chosen. Ends with a verdict against --policy on held-out seeds and on every third
    scenario, which no trial runs, and the next command. Writes episodes.jsonl, trials.csv,
    tuning.png, importances.json, chosen.json, and chosen/*.yaml with their results on the held-out
    seeds.
    """
    from .tune import run_tune  # noqa: PLC0415 - help needs no simulator

    seeds = values.pop("episodes")
    return run_tune(experiment=Experiment.taken_from(values), episodes=seeds, **values)


@command(
    "falsify",
    examples=[
        "awarenav falsify --policy mine.yaml --workers 8 --out worst",
        "awarenav crossings --scenario worst/worst_001.yaml --policy mine.yaml",
    ],
    exit_status={
        0: "The moving robot touched nobody who had never looked, or only when it asked them to.",
        1: "It touched somebody like that, inevitably or not.",
        2: "Bad input.",
        130: "Interrupted; summary.json and episodes.csv are those of the episodes so far.",
    },
    epilog="A killed or interrupted search continues with the same command and --resume, and ends "
    "with the same result, whatever --workers is. --episodes may be raised then. Needs the extra "
    "'bench'.",
)
@conditions_options(
    many=("scenario",),
    without=("fault",),
    scenario={
        "help": "Scenarios: shipped ones, YAML files, or a set of shipped ones that have a planner "
        f"and people: {SETS_TEXT}.",
        "default": ["all", "step_out"],
    },
)
@option(
    "--against",
    default="",
    show_default="balanced; blind for balanced itself",
    metavar="NAME|FILE",
    shell_complete=COMPLETE_SIMULATED_POLICIES,
    help="Policy that the worst cases are run with too, for the verdict.",
)
@option(
    "--episodes",
    type=POSITIVE,
    default=2000,
    metavar="N",
    help="Least number of episodes: half of them are spread over all scenarios, the other half "
    "over the worst third.",
)
@option(
    "--generation",
    type=POSITIVE,
    default=12,
    metavar="N",
    help="Episodes that are proposed together.",
)
@option(
    "--people",
    type=POSITIVE,
    default=2,
    metavar="N",
    help="Number of people of a scenario that are varied.",
)
@option("--worst", type=POSITIVE, default=10, metavar="N", help="Number of cases to write.")
@option(
    "--unsafe-no-floor",
    is_flag=True,
    excludes="--planner",
    help="UNSAFE, for the simulation only: a planner that ignores the adapter's radii and "
    "speed limits. Checks that the search finds the contacts.",
)
@options.workers(1)
@options.out_folder("falsify")
@options.resume()
@options.overwrite()
@options.as_json()
def falsify(**values: Any) -> int:
    """Search for the situations in which a policy does worst.

    Varies start, path, speed, pauses, gaze and reactions of a scenario's people, within human
    limits. Looks for contacts of the moving robot with people who have never noticed it, or only
    when it asked them to, and for the smallest margin to those who never looked. Contacts with
    people who looked of their own accord are counted apart. A contact is inevitable if not even
    a robot at 0.25 m/s could have stopped, from when its cause could first be seen.
    People of --population recorded do not draw the speed and glances that are varied; --seed draws
    their pace, sway and starts by chance. Ends with a verdict against another policy in the same
    situations, and the next command. Writes worst_001.yaml and so on (`awarenav crossings
    --scenario` runs them again), episodes.csv, falsify.png, summary.json and episodes.jsonl.
    """
    from .falsify import run_falsify  # noqa: PLC0415 - help needs no simulator

    episodes = values.pop("episodes")
    return run_falsify(experiment=Experiment.taken_from(values), episodes=episodes, **values)
