"""What a trial came to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a trial came to.

    Attributes:
        values: the objectives, smaller is better; None for a trial that could not be judged.
        constraints: by name; kept where at most 0.
        notes: figures to keep beside the trial, plain JSON values.
    """

    values: tuple[float, ...] | None
    constraints: Mapping[str, float] = field(default_factory=dict)
    notes: Mapping[str, object] = field(default_factory=dict)
