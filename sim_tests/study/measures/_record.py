"""One episode as one row: what every table, report and search reads.

An episode as a row of text and back: one schema for files, resumed runs and tables.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, fields
from typing import Any, Final, Literal, get_args

from ...world.errors import SimError

#: How the person who came nearest stood to the robot before the encounter, and what the robot made
#: of it; empty when nobody came near.
Awareness = Literal["", "aware", "unaware", "falsely_aware", "missed_aware"]


@dataclass(frozen=True, slots=True)
class EpisodeRecord:
    """One episode; the definitions stand in docs/metrics.md. None: does not apply.

    Attributes:
        scenario: its name.
        seed: of the episode.
        policy: name of the policy.
        planner: name of the planner.
        perception: ``"truth"``, ``"keypoints"`` or ``"pixels"``.
        success: the goal was reached and the robot touched nobody by its own motion.
        contact: robot and a person touched.
        contact_by: ``"robot"``, ``"person"`` or empty.
        min_separation_m: smallest distance between the surfaces of robot and person.
        time_to_goal_s: None when the goal was not reached.
        max_speed_within_2m_mps: the robot's highest speed with a person's surface within 2 m.
        min_margin_m: smallest separation margin S − S_p at a moving robot.
        violation_time_s: how long the margin was negative at a moving robot.
        contacts: number of contacts.
        duration_s: simulated time.
        scenario_version: of the scenario.
        attention: the scenario's ``attention``: ``"attentive"``, ``"unaware"`` or ``"mixed"``.
        fault: name of the fault, empty for none.
        time_without_people_s: the same task in the empty hall.
        time_lost_s: over that; an episode that does not reach the goal lost all of its time.
        path_length_m: driven.
        spl: success weighted by path length (Anderson et al. 2018).
        speed_at_min_separation_mps: of the robot.
        min_time_to_collision_s: smallest.
        post_encroachment_s: smallest time between one leaving a place and the other entering it.
        intimate_s: with a person's surface within 0.45 m.
        personal_s: within 1.2 m.
        robot_contacts: contacts of a robot that moved into a person.
        person_contacts: contacts of people who walked into the robot.
        contact_speed_mps: the robot's highest speed at a contact that it caused.
        peak_deceleration_mps2: of the robot.
        peak_jerk_mps3: of the robot.
        stops: how often the robot came to a stand before the goal.
        human_delay_s: of all people, over their free walks.
        human_detour_m: of all people, over their free ways.
        warnings: alerts asked for.
        awareness_error: mean |α of the track − true α| over the people tracked.
        awareness: how the person who came nearest stood to the robot.
        reaction: of that person, see :class:`PersonOutcome`.
        error: why there is no result, empty when there is; everything else is then empty or False.
    """

    scenario: str
    seed: int
    policy: str
    planner: str
    perception: str
    success: bool = False
    contact: bool = False
    contact_by: str = ""
    min_separation_m: float | None = None
    time_to_goal_s: float | None = None
    max_speed_within_2m_mps: float | None = None
    min_margin_m: float | None = None
    violation_time_s: float | None = None
    contacts: int = 0
    duration_s: float | None = None
    scenario_version: int = 1
    attention: str = "mixed"
    fault: str = ""
    time_without_people_s: float | None = None
    time_lost_s: float | None = None
    path_length_m: float | None = None
    spl: float | None = None
    speed_at_min_separation_mps: float | None = None
    min_time_to_collision_s: float | None = None
    post_encroachment_s: float | None = None
    intimate_s: float | None = None
    personal_s: float | None = None
    robot_contacts: int = 0
    person_contacts: int = 0
    contact_speed_mps: float | None = None
    peak_deceleration_mps2: float | None = None
    peak_jerk_mps3: float | None = None
    stops: int = 0
    human_delay_s: float | None = None
    human_detour_m: float | None = None
    warnings: int = 0
    awareness_error: float | None = None
    awareness: Awareness = ""
    reaction: str = ""
    error: str = ""


Kind = Literal["text", "flag", "count", "number"]

#: Numbers are written with so many decimals: micrometres, and far below what physics repeats.
DECIMALS: Final = 6

_KINDS: Final[dict[str, Kind]] = {
    "str": "text",
    "Awareness": "text",
    "bool": "flag",
    "int": "count",
    "float | None": "number",
}
#: Columns of ``episodes.csv`` in their order, and what each holds.
COLUMN_KINDS: Final[dict[str, Kind]] = {
    field.name: _KINDS[str(field.type)] for field in fields(EpisodeRecord)
}
RECORD_COLUMNS: Final = tuple(COLUMN_KINDS)
#: Columns that a table cannot do without; others take their defaults.
NEEDED_COLUMNS: Final = tuple(
    field.name for field in fields(EpisodeRecord) if field.default is MISSING
)


def rounded(value: float | None) -> float | None:
    """A number as it will be read back from a file; None for None, NaN and infinity.

    A record measured now and the same one read again are equal, so that a run that was resumed
    gives what an uninterrupted one gives.
    """
    if value is None or not math.isfinite(value):
        return None
    return float(f"{value:.{DECIMALS}f}") + 0.0  # no negative zero


def record_row(record: EpisodeRecord) -> list[str]:
    """The cells of one episode in the order of :data:`RECORD_COLUMNS`.

    Numbers have six decimals, what does not apply is empty, and line breaks in texts become
    spaces, so that an episode is a line whatever its error message says.
    """
    return [_cell(kind, getattr(record, name)) for name, kind in COLUMN_KINDS.items()]


def plain_text(text: str) -> str:
    """A text on one line, and without NUL, which the csv module refuses before Python 3.11."""
    return " ".join(text.replace("\0", "").splitlines())


def check_columns(columns: Sequence[str], source: str) -> None:
    """Refuse a header that is not that of a table of episodes.

    Raises:
        SimError: a column is unknown, there twice, or a needed one is missing.
    """
    for name in columns:
        if name not in COLUMN_KINDS:
            near = difflib.get_close_matches(name, RECORD_COLUMNS, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise SimError(
                f"{source} is not a table of episodes: unknown column {name[:80]!r}{hint} "
                "(docs/metrics.md lists all)"
            )
        if list(columns).count(name) > 1:
            raise SimError(f"{source} has the column {name!r} {list(columns).count(name)} times")
    missing = [name for name in NEEDED_COLUMNS if name not in columns]
    if missing:
        raise SimError(f"{source} is not a table of episodes: it has no column {missing[0]!r}")


def parse_row(columns: Sequence[str], cells: Sequence[str], source: str) -> EpisodeRecord:
    """The episode of a row.

    Args:
        columns: the header, checked.
        cells: as many texts.
        source: file and line, for messages.

    Raises:
        SimError: a cell does not hold what its column says, or there are more or fewer cells.
    """
    if len(cells) != len(columns):
        raise SimError(f"{source} has {len(cells)} cells, its header {len(columns)}")
    values: dict[str, Any] = {
        name: _value(name, cell, source) for name, cell in zip(columns, cells, strict=True)
    }
    return EpisodeRecord(**values)


def _cell(kind: Kind, value: Any) -> str:
    if kind == "number":
        number = rounded(value)
        return "" if number is None else f"{number:.{DECIMALS}f}"
    if kind == "flag":
        return str(bool(value)).lower()
    if kind == "count":
        return str(int(value))
    return plain_text(str(value))


def _value(name: str, cell: str, source: str) -> Any:
    kind = COLUMN_KINDS[name]
    if kind == "flag":
        if cell not in ("true", "false"):
            raise SimError(f"{source}: {name} must be true or false, got {cell[:80]!r}")
        return cell == "true"
    if kind == "text":
        if name == "awareness" and cell not in get_args(Awareness):
            known = ", ".join(map(repr, get_args(Awareness)))
            raise SimError(f"{source}: awareness must be one of {known}, got {cell[:80]!r}")
        return cell
    if kind == "number" and not cell:
        return None
    try:
        number = int(cell) if kind == "count" else float(cell)
    except ValueError as cause:
        what = "a whole number" if kind == "count" else "a number or empty"
        raise SimError(f"{source}: {name} must be {what}, got {cell[:80]!r}") from cause
    if not math.isfinite(number):
        raise SimError(f"{source}: {name} must be finite or empty, got {cell[:80]!r}")
    return number
