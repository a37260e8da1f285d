"""The verdict of a falsification: the worst cases beside those of another policy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

from awarenav.errors import counted

from ...crossing import named_policy
from ...study.measures import EpisodeRecord
from ...study.runs import policy_of, policy_text, run_episode
from .._verdict import listed
from ._falsify import Falsification, FalsifySettings, job_of
from ._worst_cases import WorstCase

#: Default of ``--against``, and the other policy for that one itself.
_BASE: Final = "balanced"
_BASE_OF_BASE: Final = "blind"


def policy_against(given: str, settings: FalsifySettings) -> tuple[str, str] | None:
    """Return the name and the YAML of the policy to compare with.

    Args:
        given: a preset or a YAML file; empty for ``balanced``, or ``blind`` for ``balanced``.
        settings: settings of the falsification.

    Returns:
        None if the floor is taken away, which leaves nothing to compare.

    Raises:
        NavError: an unusable policy.
    """
    if settings.unsafe_no_floor:
        return None
    names = (given,) if given else (_BASE, _BASE_OF_BASE)
    policies = [(name, policy_text(policy)) for name, policy in map(named_policy, names)]
    own = policy_of(settings.policy)
    return next((each for each in policies if policy_of(each[1]) != own), policies[-1])


def records_against(
    cases: Sequence[WorstCase], against: tuple[str, str] | None, settings: FalsifySettings
) -> dict[str, EpisodeRecord]:
    """Run the worst cases with another policy; return the records by the name of the file."""
    if against is None:
        return {}
    name, policy = against
    other = replace(settings, policy_name=name, policy=policy)
    return {case.path.name: run_episode(job_of(other, case.scenario)) for case in cases}


def verdict_text(
    falsification: Falsification,
    cases: Sequence[WorstCase],
    others: Mapping[str, EpisodeRecord],
) -> str:
    """Return what the search has found about a policy, and what another one does there."""
    name, episodes = falsification.settings.policy_name, len(falsification.trials)
    contacts, searched = falsification.contacts, counted(len(falsification.trials), "episode")
    if falsification.settings.unsafe_no_floor:
        found = "finds" if contacts else "does not find"
        return (
            f"the search {found} contacts of a robot without its floor ({contacts} of {episodes})."
        )
    if contacts:
        text = (
            f"{name} is not safe enough: the robot moved into a person in {contacts} of {searched}."
        )
    else:
        text = (
            f"no contact that the robot caused with {name} in {searched}. A search is not a "
            "sample, so this gives no rate."
        )
    return " ".join([text, *_comparison(name, cases, others)])


def _comparison(
    name: str, cases: Sequence[WorstCase], others: Mapping[str, EpisodeRecord]
) -> list[str]:
    """Return the sentences about the same situations with the other policy."""
    pairs = [(case.record, others[case.path.name]) for case in cases if case.path.name in others]
    pairs = [pair for pair in pairs if not any(record.error for record in pair)]
    if not pairs:
        return []
    other = pairs[0][1].policy
    touched = [
        sum(record.robot_contacts > 0 for record in side) for side in zip(*pairs, strict=True)
    ]
    margins = [
        (mine.min_margin_m, theirs.min_margin_m)
        for mine, theirs in pairs
        if mine.min_margin_m is not None and theirs.min_margin_m is not None
    ]
    better = sum(theirs > mine for mine, theirs in margins)
    worse = sum(theirs < mine for mine, theirs in margins)
    parts = [f"touches a person in {touched[1]} ({name} in {touched[0]})"]
    if margins:
        deepest = [min(side) for side in zip(*margins, strict=True)]
        parts += [
            f"keeps more margin in {better} and less in {worse}",
            f"falls to {deepest[1]:.2f} m at worst ({name} to {deepest[0]:.2f} m)",
        ]
    return [
        f"In the {counted(len(pairs), 'worst case')} of this search, {other} {listed(parts)}.",
        f"They were searched for {name}, so they show where it does worse, not how often.",
    ]
