"""``awarenav falsify`` from its options to its last line."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from awarenav.policies import read_policy

from ...crossing.eyes import PerceptionKind
from ...study.runs import policy_text
from .._templates import named_templates
from ._falsify import Falsification, FalsifySettings, falsify
from ._picture import draw_falsification
from ._worst import WorstCase, write_episodes, write_summary, write_worst


@dataclass(frozen=True, slots=True, kw_only=True)
class FalsifyOptions:
    """The options of ``awarenav falsify``."""

    policy: str
    scenario: tuple[str, ...]
    episodes: int
    generation: int
    people: int
    worst: int
    perception: PerceptionKind
    camera: str
    planner: str
    unsafe_no_floor: bool
    seed: int
    workers: int
    out: Path
    resume: bool
    as_json: bool


def falsify_command(options: FalsifyOptions) -> int:
    """Run the command and return its exit status.

    Raises:
        SimError: for options that cannot be used.
        NavError: for a policy that cannot be used.
    """
    templates = named_templates(options.scenario, options.camera)
    settings = FalsifySettings(
        policy_name=Path(options.policy).stem,
        policy=policy_text(read_policy(options.policy)),
        scenarios=tuple(each.to_text() for each in templates),
        episodes=options.episodes,
        people=options.people,
        perception=options.perception,
        planner=options.planner,
        seed=options.seed,
        generation=options.generation,
        unsafe_no_floor=options.unsafe_no_floor,
    )
    if settings.unsafe_no_floor:
        print(
            "UNSAFE: the adapter's floor is taken away on purpose. What follows is about no robot "
            "that should ever drive.",
            file=sys.stderr,
        )
    found = falsify(settings, options.out, workers=options.workers, resume=options.resume)
    write_episodes(found, options.out / "episodes.csv")
    cases = write_worst(found, options.out, options.worst)
    write_summary(found, cases, options.out / "summary.json")
    draw_falsification(found, cases, options.out / "falsify.png")
    if options.as_json:
        print((options.out / "summary.json").read_text(encoding="utf-8"), end="")
    else:
        print("\n".join(table_lines(found, cases)))
        print(f"Written to {options.out}")
    return 1 if found.contacts else 0


def table_lines(found: Falsification, cases: Sequence[WorstCase]) -> list[str]:
    """The worst cases, and what was found in all, as lines of text."""
    lines = [
        f"{'file':16s}{'scenario':24s}{'margin':>9s}{'separation':>12s}{'robot':>10s}"
        f"  {'contact by':12s}{'awareness':16s}{'reaction':12s}"
    ]
    for case in cases:
        record = case.record
        lines.append(
            f"{case.path.name:16s}{case.find.scenario:24s}{_number(record.min_margin_m):>7s} m"
            f"{_number(record.min_separation_m):>10s} m"
            f"{_number(record.speed_at_min_separation_mps):>6s} m/s"
            f"  {record.contact_by or '-':12s}{record.awareness or '-':16s}"
            f"{record.reaction or '-':12s}" + ("" if case.replays else "  DOES NOT REPLAY")
        )
    contacts, episodes = found.contacts, len(found.finds)
    lines.append(f"{contacts} of {episodes} episodes with a contact that the robot caused.")
    if found.errors:
        lines.append(f"{found.errors} episodes have no result; episodes.csv says why.")
    return lines


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"
