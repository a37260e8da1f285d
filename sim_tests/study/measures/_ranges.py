"""Numbers that an episode can have; a row with others is damaged."""

from __future__ import annotations

from typing import Final

from ...world.errors import SimError
from ._record import COLUMN_KINDS, EpisodeRecord

# Figures that are distances, times or magnitudes. The others can be negative: a margin, the time
# lost, people's delay and detour, and the fit of a deceleration.
_NOT_NEGATIVE: Final = (
    "min_separation_m",
    "time_to_goal_s",
    "max_speed_within_2m_mps",
    "violation_time_s",
    "duration_s",
    "time_without_people_s",
    "path_length_m",
    "spl",
    "speed_at_min_separation_mps",
    "min_time_to_collision_s",
    "post_encroachment_s",
    "intimate_s",
    "personal_s",
    "awareness_error",
    "attentive_share",
    "moving_contact_mps",
    "moving_contact_unaware_mps",
    *(name for name in COLUMN_KINDS if name.startswith("step_out_")),
    *(name for name, kind in COLUMN_KINDS.items() if kind == "count" and name != "seed"),
)
_AT_MOST_ONE: Final = ("spl", "awareness_error", "attentive_share")
# Any figure of an episode is far smaller, in metres, seconds or counts.
_LARGEST: Final = 1e9
_CONTACTS_BY: Final = ("", "robot", "person")


def check_ranges(record: EpisodeRecord, source: str) -> EpisodeRecord:
    """Return a record whose figures are those of an episode.

    Args:
        record: read from a file.
        source: file and line, for messages.

    Raises:
        SimError: a figure is out of range.
    """
    for name, kind in COLUMN_KINDS.items():
        value = getattr(record, name)
        if kind not in ("count", "number") or value is None or name == "seed":
            continue
        low = 0.0 if name in _NOT_NEGATIVE else -_LARGEST
        high = 1.0 if name in _AT_MOST_ONE else _LARGEST
        if not low <= value <= high:
            raise SimError(f"{source}: {name} must lie in [{low:g}, {high:g}], got {value:g}")
    if record.contact_by not in _CONTACTS_BY:
        raise SimError(
            f"{source}: contact_by must be one of {', '.join(map(repr, _CONTACTS_BY))}, got "
            f"{record.contact_by[:80]!r}"
        )
    return record
