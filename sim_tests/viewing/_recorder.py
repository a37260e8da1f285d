"""A crossing as states for a page: an observer, pictures of the camera, and JSON values."""

from __future__ import annotations

import base64
import math
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, replace
from typing import Any, Final

import cv2
import numpy as np

from nav_adapter import Alert, PersonObstacle
from nav_adapter.alerts import Answer
from perception import AttentionCone
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ..conditions import Conditions
from ..crossing import (
    STANDING_SPEED_MPS,
    CrossingFrame,
    CrossingResult,
    RequestMemory,
    Stage,
    camera_view,
)

# A scan older than this is not drawn.
_SCAN_AGE_S: Final = 0.2
_WIDTH_PX: Final = 480
_JPEG_QUALITY: Final = 75
#: States per second of simulated time; fewer where the robot's control is slower.
STATES_HZ: Final = 20.0
# The plan shows the robot's way with this margin.
_PLAN_MARGIN_M: Final = 3.0
# Scan points closer together than this are drawn as one.
_SCAN_CELL_CM: Final = 5
_MOST_SCAN_POINTS: Final = 400


class CrossingRecorder:
    """Turns the control cycles of a crossing into states for a page.

    Give it to :func:`~sim_tests.crossing.run_crossing` as ``observer``.

    Attributes:
        begin: hall, robot and names; empty before the first control cycle.
        states: the states so far.
    """

    def __init__(
        self,
        conditions: Conditions,
        *,
        pictures: CameraPictures | None = None,
        on_begin: Callable[[dict[str, Any]], None] | None = None,
        on_state: Callable[[dict[str, Any]], None] | None = None,
    ) -> None:
        self._conditions = conditions
        self._pictures = pictures
        self._on_begin = on_begin
        self._on_state = on_state
        self._cycles = 0
        self._scan = np.zeros((0, 2))
        self._scan_s = 0.0
        self._alerts: tuple[Alert, ...] = ()
        self._answers: tuple[Answer, ...] = ()
        self._memory = RequestMemory()
        self.begin: dict[str, Any] = {}
        self.states: list[dict[str, Any]] = []

    def __call__(self, frame: CrossingFrame, stage: Stage) -> None:
        """Take one control cycle."""
        if not self.begin:
            self.begin = begin_of(self._conditions, stage)
            if self._on_begin is not None:
                self._on_begin(self.begin)
        if len(frame.scan_points_odom_m):
            self._scan, self._scan_s = frame.scan_points_odom_m, frame.t_s
        elif frame.t_s - self._scan_s > _SCAN_AGE_S:
            self._scan = np.zeros((0, 2))
        number, self._cycles = self._cycles, self._cycles + 1
        self._memory.take(frame)
        # An alert is in one control cycle only, which may be one between two states.
        limit = frame.constraints
        self._alerts += limit.alerts
        self._answers += limit.answers
        if number % cycles_per_state(stage.scenario.control_hz):
            return
        limit = replace(limit, alerts=self._alerts, answers=self._answers)
        self._alerts, self._answers = (), ()
        state = state_of(replace(frame, constraints=limit), stage, self._scan, self._memory)
        picture = None if self._pictures is None else self._pictures.take(frame, stage)
        if picture is not None:
            state["picture"] = picture
        self.states.append(state)
        if self._on_state is not None:
            self._on_state(state)

    @property
    def note(self) -> str:
        """The reason for which there are no pictures; empty where there are."""
        if self._pictures is None:
            return "Recorded without the robot's camera."
        return self._pictures.trouble


class CameraPictures:
    """Renders the robot's camera while a crossing runs.

    A renderer that fails ends the pictures and not the crossing; ``trouble`` then says why.

    Args:
        pictures_hz: most pictures per second of simulated time.
        box_scale: as for :func:`~sim_tests.crossing.draw_camera_view`.
        share: most of the elapsed time that rendering may take, > 0; 1 for no limit.

    Attributes:
        trouble: why there are no more pictures; empty without trouble.
    """

    def __init__(
        self, pictures_hz: float = 5.0, *, box_scale: float = 1.0, share: float = 1.0
    ) -> None:
        self._period_s = 1.0 / pictures_hz
        self._box_scale = box_scale
        self._share = share
        self._due_s = 0.0
        self._not_before = 0.0
        self.trouble = ""

    def take(self, frame: CrossingFrame, stage: Stage) -> str | None:
        """Return the picture of a frame, a JPEG in base64; None if none is due."""
        begun = time.monotonic()
        if self.trouble or frame.t_s < self._due_s or begun < self._not_before:
            return None
        try:
            drawn = camera_view(frame, stage, _WIDTH_PX, box_scale=self._box_scale, captions=False)
        except Exception as error:  # drivers of graphics raise errors of every kind
            self.trouble = f"The camera cannot be rendered here: {error}"
            return None
        _, data = cv2.imencode(
            ".jpg",
            cv2.cvtColor(drawn, cv2.COLOR_RGB2BGR),
            [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY],
        )
        self._due_s = max(self._due_s + self._period_s, frame.t_s)
        if self._share < 1.0:
            self._not_before = begun + (time.monotonic() - begun) / self._share
        return base64.b64encode(data.tobytes()).decode("ascii")


def begin_of(conditions: Conditions, stage: Stage) -> dict[str, Any]:
    """Return what stays the same in a crossing: hall, robot, goal and names.

    Lengths are in metres in odom, boxes are x_min, y_min, x_max, y_max.
    """
    scenario, warehouse = stage.scenario, stage.warehouse
    task, camera = scenario.robot, scenario.camera
    hall = scenario.layout
    floor = (hall.x_min_m, hall.y_min_m, hall.x_max_m, hall.y_max_m)
    return {
        **asdict(conditions),
        "step_s": cycles_per_state(scenario.control_hz) / scenario.control_hz,
        "planned_s": scenario.duration_s,
        "floor_odom_m": _rounded(floor),
        "plan_odom_m": _rounded(task.window_odom_m(_PLAN_MARGIN_M)),
        "boxes_odom_m": [_rounded(box) for box in warehouse.obstacle_boxes_odom],
        "goal_odom_m": _rounded((task.goal_x_m, task.goal_y_m)),
        "footprint_m": [_rounded(corner) for corner in stage.amr.profile.footprint_m],
        "max_speed_mps": _rounded_number(stage.amr.profile.max_speed_mps),
        "cone_half_angle_rad": _rounded_number(AttentionCone().half_angle_rad),
        "body_radius_m": BODY_RADIUS_M,
        "camera_fov_rad": _rounded_number(
            math.radians(min(camera.horizontal_fov_deg * len(camera.views_deg), 360.0))
        ),
        "picture_aspect": _rounded_number(camera.width_px / camera.height_px),
    }


def cycles_per_state(control_hz: float) -> int:
    """Return after how many control cycles a state follows, at least 1."""
    return max(round(control_hz / STATES_HZ), 1)


def state_of(
    frame: CrossingFrame,
    stage: Stage,
    scan_points_odom_m: FloatArray | None = None,
    memory: RequestMemory | None = None,
) -> dict[str, Any]:
    """Return one control cycle as a JSON value.

    Returns:
        ``robot_odom`` is x (m), y (m) and heading (rad); each of ``people``, the truth, has
        ``odom`` (x, y and direction of gaze), the true α, distance and margin; each of ``tracks``
        has ``odom`` (x, y, vx, vy), α with its standard deviation and lower bound; each of
        ``obstacles`` has its radius, and ``noticed_s``, how long ago the person has looked, where
        that counts instead of α. ``alerts`` are the tracks that are warned of a collision. Each
        of ``requests`` to look at the robot has the track, the means, the time that a look would
        win and the reason; each of ``answers`` has the track and the time since the request. All
        three are in one state only. A number that is not finite is None.
    """
    state, limit = frame.robot_state, frame.constraints
    points = frame.scan_points_odom_m if scan_points_odom_m is None else scan_points_odom_m
    window = stage.scenario.robot.window_odom_m(_PLAN_MARGIN_M)
    return {
        "t_s": _rounded_number(frame.t_s),
        "robot_odom": _rounded((*state.position_odom_m, state.heading_odom_rad)),
        "speed_mps": _rounded_number(state.speed_mps),
        "command_mps": _rounded_number(frame.command[0]),
        "limit_mps": _rounded_number(limit.speed_limit_mps),
        "limited_by": limit.limited_by,
        "stale": limit.stale,
        "braking_suffices": limit.braking_suffices,
        "alerts": [each.track_id for each in limit.alerts if each.kind != "attention"],
        "requests": [
            {
                "id": each.track_id,
                "means": each.means,
                "wins_s": _rounded_number(each.wins_s),
                "reason": each.reason,
            }
            for each in limit.alerts
            if each.kind == "attention"
        ],
        "answers": [
            {"id": each.track_id, "after_s": _rounded_number(each.after_s)}
            for each in limit.answers
        ],
        "people": _people(frame),
        "tracks": [
            {
                "id": track.id,
                "status": track.status,
                "odom": _rounded((*track.position_odom_m, *track.velocity_odom_mps)),
                "awareness": _rounded_number(track.awareness),
                "awareness_std": _rounded_number(track.awareness_std),
                "awareness_lower": _rounded_number(track.awareness_lower),
            }
            for track in frame.tracks
        ],
        "obstacles": [
            _obstacle(each, None if memory is None else memory.noticed_s(each, frame))
            for each in limit.obstacles
        ],
        "scan_odom_cm": _scan(points, window),
    }


def outcome_text(result: CrossingResult) -> str:
    """Return the outcome of a crossing as one sentence without a full stop."""
    parts = ["Goal not reached"]
    if result.time_to_goal_s is not None:
        parts = [f"Goal reached after {result.time_to_goal_s:.2f} s"]
    if math.isfinite(result.min_separation_m):
        parts.append(f"least separation {result.min_separation_m:.2f} m")
    if math.isfinite(result.min_margin_m):
        parts.append(f"least margin {result.min_margin_m:.2f} m")
    if result.contact:
        moving = any(each.robot_speed_mps > STANDING_SPEED_MPS for each in result.contacts)
        robot = "moving" if moving else "standing"
        parts.append(f"contact with the {robot} robot, caused by the {result.contact_by}")
    if result.bumps:
        parts.append("the robot ran into a rack or a wall")
    return ", ".join(parts)


def _people(frame: CrossingFrame) -> list[dict[str, Any]]:
    people = []
    for index, view in enumerate(frame.truth):
        gaze = frame.T_odom_camera[:3, :3] @ view.gaze_camera
        people.append(
            {
                "odom": _rounded((*view.position_odom_m, math.atan2(gaze[1], gaze[0]))),
                "awareness": _rounded_number(view.awareness),
                "separation_m": _at(frame.separations_m, index),
                "margin_m": _at(frame.margins_m, index),
            }
        )
    return people


def _obstacle(obstacle: PersonObstacle, noticed_s: float | None) -> dict[str, Any]:
    return {
        "id": obstacle.track_id,
        "odom": _rounded(obstacle.center_odom_m),
        "radius_m": _rounded_number(obstacle.radius_m),
        "awareness_lower": _rounded_number(obstacle.awareness_lower),
        "noticed_s": None if noticed_s is None else _rounded_number(noticed_s),
    }


def _scan(points_odom_m: FloatArray, window: tuple[float, float, float, float]) -> list[int]:
    """Return the points in the window as x, y, x, y … in centimetres, thinned to cells."""
    low, high = np.array(window[:2]), np.array(window[2:])
    inside = points_odom_m[((points_odom_m >= low) & (points_odom_m <= high)).all(axis=1)]
    cells = np.unique(np.round(inside * (100.0 / _SCAN_CELL_CM)).astype(int), axis=0)
    step = -(-len(cells) // _MOST_SCAN_POINTS) or 1
    thinned: list[int] = (_SCAN_CELL_CM * cells[::step]).ravel().tolist()
    return thinned


def _at(values: tuple[float, ...], index: int) -> float | None:
    return _rounded_number(values[index]) if index < len(values) else None


def _rounded(values: Iterable[Any]) -> list[float | None]:
    return [_rounded_number(each) for each in values]


def _rounded_number(value: float) -> float | None:
    """Return a number to a thousandth; None for one that is not finite."""
    number = float(value)
    return round(number, 3) + 0.0 if math.isfinite(number) else None
