"""The command ``awarenav falsify``: search, write the worst cases, print a table."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from awarenav.errors import counted

from ...crossing.eyes import Perception, PerceptionKind, SensorSet
from .._files import common_settings
from .._verdict import Verdict, command_text, episode_words
from ._falsify import Falsification, FalsifySettings, falsify
from ._plot import draw_falsification
from ._verdict import policy_against, records_against, verdict_text
from ._worst_cases import POLICY_FILE, WorstCase, write_episodes, write_summary, write_worst


@dataclass(frozen=True, slots=True, kw_only=True)
class FalsifyOptions:
    """The options of ``awarenav falsify``."""

    policy: str
    against: str
    scenario: tuple[str, ...]
    episodes: int
    generation: int
    people: int
    worst: int
    perception: PerceptionKind
    sensors: SensorSet
    camera: str
    robot: str
    population: str | None
    planner: str
    unsafe_no_floor: bool
    seed: int
    workers: int
    out: Path
    resume: bool
    overwrite: bool
    as_json: bool


def falsify_command(options: FalsifyOptions) -> int:
    """Run the command and return its exit status.

    Raises:
        SimError: an unusable option.
        NavError: an unusable policy.
    """
    settings = FalsifySettings(
        **common_settings(
            options.policy,
            options.scenario,
            options.camera,
            options.population or "",
            options.robot,
        ),
        episodes=options.episodes,
        people=options.people,
        perception=Perception.of(options.perception, options.sensors).name,
        planner=options.planner,
        seed=options.seed,
        generation=options.generation,
        unsafe_no_floor=options.unsafe_no_floor,
    )
    if settings.unsafe_no_floor:
        print(
            "UNSAFE: the adapter's floor is taken away on purpose. No robot may drive like this.",
            file=sys.stderr,
        )
    against = policy_against(options.against, settings)
    falsification = falsify(
        settings,
        options.out,
        workers=options.workers,
        resume=options.resume,
        overwrite=options.overwrite,
    )
    write_episodes(falsification, options.out / "episodes.csv")
    cases = write_worst(falsification, options.out, options.worst)
    others = records_against(cases, against, settings)
    text = verdict_text(falsification, cases, others)
    write_summary(falsification, cases, options.out / "summary.json", verdict=text, against=others)
    draw_falsification(falsification, cases, options.out / "falsify.png")
    if options.as_json:
        print((options.out / "summary.json").read_text(encoding="utf-8"), end="")
    else:
        print("\n".join(_table_lines(falsification, cases)))
        print("\n".join(Verdict(text, _next_command(falsification, options)).lines()))
        print(f"Written to {options.out}")
    return 1 if falsification.contacts else 0


def _table_lines(falsification: Falsification, cases: Sequence[WorstCase]) -> list[str]:
    """Return the worst cases and the totals as lines of text."""
    lines = [
        f"{'file':16s}{'scenario':24s}{'margin':>9s}{'separation':>12s}{'robot':>10s}"
        f"  {'contact by':12s}{'awareness':16s}{'reaction':12s}"
    ]
    for case in cases:
        record = case.record
        lines.append(
            f"{case.path.name:16s}{case.trial.scenario:24s}"
            f"{_two_decimals(record.min_margin_unaware_m):>7s} m"
            f"{_two_decimals(record.min_separation_m):>10s} m"
            f"{_two_decimals(record.speed_at_min_separation_mps):>6s} m/s"
            f"  {record.contact_by or '-':12s}{record.awareness or '-':16s}"
            f"{record.reaction or '-':12s}" + ("" if case.replays else "  DOES NOT REPLAY")
        )
    contacts, episodes = falsification.contacts, len(falsification.trials)
    lines.append(
        f"{contacts} of {counted(episodes, 'episode')} with a contact of the moving robot and a "
        f"person who had not looked for 1 s; {falsification.aware_contacts} with a person who had."
    )
    if falsification.errors:
        broken = counted(falsification.errors, "episode has", "episodes have")
        lines.append(f"{broken} no result; episodes.csv says why.")
    return lines


def _next_command(falsification: Falsification, options: FalsifyOptions) -> str:
    """Return the command to run after the search."""
    if options.unsafe_no_floor:
        return command_text(
            *("falsify", "--policy", options.policy, *episode_words(options)),
            *("--episodes", options.episodes, "--out", f"{options.out}_with_floor"),
        )
    own = options.out / POLICY_FILE
    base = policy_against(options.against, falsification.settings)
    other = options.against or (base[0] if base else "")
    if falsification.contacts:
        # The file has the camera, the robot and the population.
        worst = (str(options.out / "worst_001.yaml"),)
        found = replace(options, scenario=worst, camera="", robot="", population=None)
        return command_text(
            *("crossings", *episode_words(found), "--policy", own, other),
            *("--seed", options.seed, "--episodes", 1, "--out", options.out / "worst"),
        )
    return command_text(
        *("crossings", *episode_words(options), "--policy", other, own, "--episodes", 44),
        *("--out", options.out / "crossings"),
    )


def _two_decimals(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"
