"""The work of ``awarenav scenario validate``."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Final

from tqdm import tqdm

from awarenav.errors import counted

from ...scenario import ScenarioTemplate
from ...scenario.catalogue import (
    CHECKED_DRAWS,
    CONFLICT_M,
    approach_statistics,
    names_of_sets,
    template_problems,
)
from ...world.errors import MissingSimulatorError, SimError

# A scenario with a smaller share of conflicts than this tests little.
_MIN_CONFLICT_SHARE: Final = 0.8
_WRONG_LABEL, _CANNOT_RUN = 1, 2


def validate_command(files: Sequence[str], episodes: int) -> int:
    """Check scenarios and print what is wrong.

    Args:
        files: names of shipped scenarios or of their sets, or YAML files.
        episodes: number of crossings that measure the attention of people.

    Returns:
        0; 1 if a scenario's people contradict its ``attention``; 2 if one cannot be run.
    """
    return max(_validate(file, episodes) for file in names_of_sets(files))


def _validate(file: str, episodes: int) -> int:
    try:
        template = ScenarioTemplate.named(file)
        found = template_problems(template)
    except SimError as error:
        print(f"{file}: cannot be run\n  {error}")
        return _CANNOT_RUN
    if found:
        print(f"{file}: cannot be run")
        print("\n".join(f"  {problem}" for problem in found))
        return _CANNOT_RUN
    approach = _approach_remark(template)
    wrong, remarks = ((), ()) if approach is None else _attention_findings(template, episodes)
    varying = counted(len(template.parameters()), "number varies", "numbers vary")
    verdict = "can be run, but its attention is wrong" if wrong else "can be run"
    print(f"{file}: {template.id}, {varying}: {verdict}")
    people = "it has no people, or only those of replay_csv" if approach is None else approach
    for line in (*wrong, people, *remarks):
        print(f"  {line}")
    return _WRONG_LABEL if wrong else 0


def _approach_remark(template: ScenarioTemplate) -> str | None:
    """Return how often robot and people would meet; None without planned people."""
    statistics = approach_statistics(template, CHECKED_DRAWS)
    if statistics is None:
        return None
    remark = (
        f"if nobody reacted, robot and somebody would be nearer than {CONFLICT_M:g} m in "
        f"{statistics.conflict_share:.0%} of {counted(statistics.draws, 'draw')}"
    )
    if statistics.conflict_share < _MIN_CONFLICT_SHARE:
        remark += ": it hardly tests the robot; let people start earlier or later"
    return remark


def _attention_findings(
    template: ScenarioTemplate, episodes: int
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return what contradicts the scenario's ``attention``, and what was measured."""
    if not episodes:
        return (), ()
    try:
        from ._attention_check import check_attention  # noqa: PLC0415 - needs the extra sim
    except MissingSimulatorError as error:
        return (), (f"what people look at was not measured: {error}",)
    seeds = range(episodes)
    with tqdm(
        seeds, desc=template.name, unit="crossing", disable=None, leave=False, file=sys.stderr
    ) as bar:
        check = check_attention(template, bar)
    return check.contradictions, check.remarks
