"""What became of one person in one episode."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PersonOutcome:
    """What became of one person in one episode.

    Attributes:
        name: of the person in the scenario.
        noticed_s: when the person first looked at the robot; None if never.
        reaction: what a person who had seen the robot did: ``"walk_on"``, ``"wait"``, ``"hurry"``,
            ``"pass_behind"`` or ``"claim"``; empty for one who never had to choose.
        time_s: from setting out to the end of the route; None if it was not reached.
        free_time_s: the same without robot and other people, pauses included; None for a person
            without a route to an end.
        length_m: walked.
        free_length_m: of the route; None as ``free_time_s``.
    """

    name: str
    noticed_s: float | None = None
    reaction: str = ""
    time_s: float | None = None
    free_time_s: float | None = None
    length_m: float = 0.0
    free_length_m: float | None = None
