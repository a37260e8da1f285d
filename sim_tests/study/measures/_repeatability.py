"""Sentences about planners that do not repeat themselves."""

from __future__ import annotations

from collections.abc import Iterable

from ._record import EpisodeRecord


def nondeterminism_notes(records: Iterable[EpisodeRecord]) -> tuple[str, ...]:
    """Return one sentence about each planner that is not deterministic in some episode."""
    by_planner: dict[str, list[bool]] = {}
    for record in records:
        if not record.error:  # an episode that broke off says nothing
            by_planner.setdefault(record.planner, []).append(record.nondeterministic)
    return tuple(
        nondeterminism_note(planner, sum(flags), len(flags))
        for planner, flags in sorted(by_planner.items())
        if any(flags)
    )


def nondeterminism_note(label: str, differing: int, episodes: int) -> str:
    """Return the sentence about a planner, or about a policy and its planner."""
    return (
        f"{label}: the planner is not deterministic. In {differing} of {episodes} episodes it "
        "drove the task without people differently the second time, with the same seed; their "
        "rows may differ when they are run again."
    )
