"""The record of one episode, and its row in a table: one schema for all files and tables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, fields
from typing import Any, Final, Literal, get_args

from awarenav.errors import did_you_mean

from ...world.errors import SimError

#: Awareness of the person who came nearest, before the encounter, and the robot's error about it if
#: there is one; empty if nobody came near.
Awareness = Literal["", "aware", "unaware", "falsely_aware", "missed_aware"]

# That of sim_tests.crossing, whose import needs the simulator.
_STANDING_SPEED_MPS: Final = 0.03


@dataclass(frozen=True, slots=True, repr=False)
class EpisodeRecord:
    """The metrics of one episode, as docs/metrics.md defines them.

    None means that a metric does not apply to the episode.

    Attributes:
        scenario: name of the scenario.
        seed: of the episode.
        policy: name of the policy.
        planner: name of the planner.
        perception: ``"truth"``, ``"keypoints"`` or ``"pixels"``, with ``"+scanner"`` if there are
            scanners too, or ``"scanner"``.
        success: the goal was reached and the robot touched nobody by its own motion.
        contact: the robot, moving or not, and a person touched.
        contact_by: ``"robot"`` if the robot moved into a person, else ``"person"``, or empty.
        min_separation_m: smallest distance between the surfaces of robot and person.
        time_to_goal_s: None when the goal was not reached.
        max_speed_within_2m_mps: the robot's highest speed with a person's surface within 2 m.
        min_margin_m: smallest separation margin S − S_p at a moving robot.
        violation_time_s: how long the margin was negative at a moving robot.
        contacts: number of contacts.
        duration_s: simulated time.
        scenario_version: version of the scenario.
        attention: the scenario's ``attention``: ``"attentive"``, ``"unaware"`` or ``"mixed"``.
        fault: name of the fault, empty for none.
        time_without_people_s: time to goal of the same task in the empty hall.
        time_lost_s: time over ``time_without_people_s``; an episode that does not reach the goal
            loses all of its time.
        path_length_m: length of the path that the robot drove.
        spl: success weighted by path length (Anderson et al. 2018).
        speed_at_min_separation_mps: the robot's speed at the smallest separation.
        min_time_to_collision_s: smallest time to collision.
        post_encroachment_s: smallest time between one leaving a place and the other entering it.
        intimate_s: time with a person's surface within 0.45 m.
        personal_s: time with a person's surface within 1.2 m.
        robot_contacts: contacts of a robot that moved into a person.
        person_contacts: contacts of people who walked into the robot.
        contact_speed_mps: the robot's highest speed at a contact that it caused.
        peak_deceleration_mps2: highest deceleration of the robot.
        peak_jerk_mps3: largest jerk of the robot.
        stops: how often the robot came to a stand before the goal.
        human_delay_s: delay of all people over their free walks, of those on the way so far.
        human_detour_m: detour of all people, over their free walks.
        warnings: number of warnings of a collision that the robot asked for.
        awareness_error: mean |α of the track − true α| over the tracked people.
        awareness: awareness of the person who came nearest, and the robot's judgement of it.
        reaction: reaction of that person, see :class:`PersonOutcome`.
        error: the error that ended the episode, empty for none; with an error, every metric keeps
            its default.
        nondeterministic: the user's planner gave other commands when it drove the task without
            people a second time, with the same seed; the row may differ in another run.
        attentive_share: smallest share of the time for which one of the people had a true α ≥ 0.5,
            while they could look at the robot within 5 m.
        moving_contacts: contacts with a moving robot, by any cause.
        moving_contact_mps: the robot's highest speed at one of them.
        moving_contacts_unaware: those of them with people who have not looked at the robot for 1 s,
            or never.
        moving_contact_unaware_mps: the robot's highest speed at one of these.
        min_margin_unaware_m: smallest separation margin at a moving robot to such people.
        step_out_unaware: expected impacts with unaware people who set off, per 1 000 crossings.
        step_out_unaware_fast: those of them at more than 0.25 m/s.
        step_out_aware: the same with aware people who ignore the robot.
        step_out_aware_fast: those of them at more than 0.25 m/s.
        step_out_worst_mps: the robot's highest closing speed in an impact with an unaware person.
        step_out_stress_unaware: ``step_out_unaware`` with faster starts than recorded.
        step_out_stress_worst_mps: ``step_out_worst_mps`` with faster starts than recorded.
        requests: number of requests for attention.
        requests_answered: those whose person then looked at the robot.
        requests_needless: those to somebody who was no obstacle a second later and had not looked.
        asked_twice: people who were asked more than once.
        requests_after_answer: requests to a track that had answered before; there should be none.
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
    nondeterministic: bool = False
    attentive_share: float | None = None
    moving_contacts: int = 0
    moving_contact_mps: float | None = None
    step_out_unaware: float | None = None
    step_out_unaware_fast: float | None = None
    step_out_aware: float | None = None
    step_out_aware_fast: float | None = None
    step_out_worst_mps: float | None = None
    step_out_stress_unaware: float | None = None
    step_out_stress_worst_mps: float | None = None
    moving_contacts_unaware: int = 0
    moving_contact_unaware_mps: float | None = None
    min_margin_unaware_m: float | None = None
    requests: int = 0
    requests_answered: int = 0
    requests_needless: int = 0
    asked_twice: int = 0
    requests_after_answer: int = 0

    def __repr__(self) -> str:
        """Return the fields that do not have their default."""
        cells = (
            f"{field.name}={getattr(self, field.name)!r}"
            for field in fields(self)
            if getattr(self, field.name) != field.default
        )
        return f"EpisodeRecord({', '.join(cells)})"

    @property
    def versioned_scenario(self) -> str:
        """The scenario, followed by its version from 2 on."""
        version = "" if self.scenario_version == 1 else f" v{self.scenario_version}"
        return self.scenario + version

    @property
    def moving_touched(self) -> bool:
        """True if a moving robot and a person touched, by any cause.

        Tables of earlier versions tell it by the robot's highest speed at a contact.
        """
        speed_mps = self.speed_at_min_separation_mps or 0.0
        return (
            self.moving_contacts > 0
            or self.robot_touched
            or (self.contact and speed_mps > _STANDING_SPEED_MPS)
        )

    @property
    def robot_touched(self) -> bool:
        """True if the robot moved into a person."""
        return self.robot_contacts > 0 or self.contact_by == "robot"

    @property
    def person_touched(self) -> bool:
        """True if a person walked into the robot."""
        return self.person_contacts > 0 or self.contact_by == "person"


Kind = Literal["text", "flag", "count", "number"]

#: Decimals of numbers in files: micrometres.
DECIMALS: Final = 6

_KINDS: Final[dict[str, Kind]] = {
    "str": "text",
    "Awareness": "text",
    "bool": "flag",
    "int": "count",
    "float | None": "number",
}
#: Columns of ``episodes.csv`` in their order, and the kind of each.
COLUMN_KINDS: Final[dict[str, Kind]] = {
    field.name: _KINDS[str(field.type)] for field in fields(EpisodeRecord)
}
RECORD_COLUMNS: Final = tuple(COLUMN_KINDS)
#: Columns that every table must have; others take their defaults.
REQUIRED_COLUMNS: Final = tuple(
    field.name for field in fields(EpisodeRecord) if field.default is MISSING
)


def rounded(value: float | None) -> float | None:
    """Return a number as it is read back from a file; None for None, NaN and infinity.

    A record in memory therefore equals the same record read from a file, and a resumed run gives
    the same records as an uninterrupted one.
    """
    if value is None or not math.isfinite(value):
        return None
    return float(f"{value:.{DECIMALS}f}") + 0.0  # no negative zero


def record_row(record: EpisodeRecord) -> list[str]:
    """Return the cells of one episode in the order of :data:`RECORD_COLUMNS`.

    Numbers have six decimals, and None is an empty cell. Line breaks in texts become spaces, so
    that an episode is always one line.
    """
    return [_cell_text(kind, getattr(record, name)) for name, kind in COLUMN_KINDS.items()]


def one_line(text: str) -> str:
    """Return a text on one line and without NUL, which the csv module of Python 3.10 refuses."""
    return " ".join(text.replace("\0", "").splitlines())


def check_columns(columns: Sequence[str], source: str) -> None:
    """Check the header of a table of episodes.

    Raises:
        SimError: a column is unknown or there twice, or a required one is missing.
    """
    for name in columns:
        if name not in COLUMN_KINDS:
            hint = did_you_mean(name, RECORD_COLUMNS)
            raise SimError(
                f"{source} is not a table of episodes: unknown column {name[:80]!r}{hint} "
                "(docs/metrics.md lists all)"
            )
        if list(columns).count(name) > 1:
            raise SimError(f"{source} has the column {name!r} {list(columns).count(name)} times")
    missing = [name for name in REQUIRED_COLUMNS if name not in columns]
    if missing:
        raise SimError(f"{source} is not a table of episodes: it has no column {missing[0]!r}")


def parse_row(columns: Sequence[str], cells: Sequence[str], source: str) -> EpisodeRecord:
    """Return the episode of a row.

    Args:
        columns: the header, already checked.
        cells: one text per column.
        source: file and line, for messages.

    Raises:
        SimError: a cell does not fit its column, or there are more or fewer cells than columns.
    """
    if len(cells) != len(columns):
        raise SimError(f"{source} has {len(cells)} cells, its header {len(columns)}")
    values: dict[str, Any] = {
        name: _parse_cell(name, cell, source) for name, cell in zip(columns, cells, strict=True)
    }
    return EpisodeRecord(**values)


def _cell_text(kind: Kind, value: Any) -> str:
    if kind == "number":
        number = rounded(value)
        return "" if number is None else f"{number:.{DECIMALS}f}"
    if kind == "flag":
        return str(bool(value)).lower()
    if kind == "count":
        return str(int(value))
    return one_line(str(value))


def _parse_cell(name: str, cell: str, source: str) -> Any:
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
