"""One episode as one row: what every table, report and search reads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

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
