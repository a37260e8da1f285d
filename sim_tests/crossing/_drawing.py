"""Drawings of a crossing: annotated camera images, and a map from above."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from awarenav.drawing import Font, awareness_colour, draw_disc, draw_line
from nav_adapter import Alert, PersonObstacle
from nav_adapter.alerts import Answer
from perception import AttentionCone, Camera, PersonObservation
from perception.arrays import FloatArray, ImageRgb

from ._result import CrossingFrame
from ._stage import Stage
from .sensors import NOBODY

_FONT: Final = Font(16, weight=450)
_TEXT_COLOUR: Final = (40, 40, 46)
_BACKGROUND_COLOUR: Final = (246, 245, 242)
_RACK_COLOUR: Final = (176, 182, 190)
_ROBOT_COLOUR: Final = (38, 84, 140)
_PATH_COLOUR: Final = (120, 120, 126)
_SCAN_COLOUR: Final = (150, 40, 120)
_CONE_LENGTH_M: Final = 0.4
# Radius of the disc that marks a person on the map.
_PERSON_RADIUS_M: Final = 0.22
# Radii of the two rings around a person who is asked, like the waves of a sound.
_WAVES_M: Final = (0.42, 0.62)
# Points farther than this outside the image are not drawn.
_FAR_PX: Final = 1.0e4
_SHIFT: Final = 4  # sub-pixel bits of OpenCV's drawing functions
#: Time for which a request or an answer is shown.
SHOWN_S: Final = 2.0
# A person looks at the robot from this estimate of α on.
_LOOKS_FROM: Final = 0.5


def draw_camera_view(
    picture: ImageRgb,
    camera: Camera,
    frame: CrossingFrame,
    stage: Stage,
    cone: AttentionCone,
    *,
    box_scale: float = 1.0,
    captions: bool = True,
    memory: RequestMemory | None = None,
) -> ImageRgb:
    """Draw boxes, gaze cones, α, radius and speed limit into an image of the robot's camera.

    Args:
        picture: (H, W, 3) RGB image of ``camera``.
        camera: camera of the image: any size, with the robot's field of view.
        frame: the frame to draw.
        stage: gives the position of the eyes, where the cone is drawn.
        cone: the attention cone.
        box_scale: size of the images that boxes were observed in, over that of the scenario's
            camera.
        captions: also write the speed limit and its reason.
        memory: of the frames so far: tells the captions how long ago somebody has looked.
    """
    image: ImageRgb = picture.copy()
    rotation, origin = frame.T_odom_camera[:3, :3], frame.T_odom_camera[:3, 3]
    scale = camera.width_px / (stage.scenario.camera.width_px * box_scale)

    def pixels(points_odom_m: FloatArray) -> FloatArray:
        return camera.project((points_odom_m - origin) @ rotation)

    for obstacle in frame.constraints.obstacles:
        angles = np.linspace(0.0, 2.0 * math.pi, 49)
        ring = np.zeros((49, 3))
        ring[:, :2] = obstacle.center_odom_m + obstacle.radius_m * np.stack(
            [np.cos(angles), np.sin(angles)], axis=1
        )
        colour = awareness_colour(obstacle.awareness_lower)
        for ends in itertools.pairwise(pixels(ring)):
            if _drawable(np.array(ends)):
                draw_line(image, np.array(ends), colour, 2)
    for observation, worker in zip(frame.observations, frame.observed_workers, strict=True):
        colour = awareness_colour(observation.awareness)
        if observation.gaze_camera is not None and worker != NOBODY:
            eyes = stage.workers[worker].eyes_odom_m
            gaze = rotation @ observation.gaze_camera
            rim = pixels(np.vstack([eyes, _cone_rim(eyes, gaze, cone.half_angle_rad)]))
            rim = rim[np.isfinite(rim).all(axis=1)]
            if len(rim) > 2 and _drawable(rim):
                _fill(image, rim, colour, 0.16)
            axis = pixels(np.stack([eyes, eyes + _CONE_LENGTH_M * gaze]))
            if _drawable(axis):
                draw_line(image, axis, colour, 2)
        if observation.box_xyxy_px is not None:
            box = observation.box_xyxy_px * scale
            place = camera.project(observation.position_camera_m[None])[0]
            apart = np.abs(place - box.reshape(2, 2).mean(axis=0))
            # A box of another view of a camera with several is not in this image.
            if (apart < 0.5 * np.array([camera.width_px, camera.height_px])).all():
                _draw_box(image, box, observation)
    if captions:
        _write(image, _captions(frame, memory or RequestMemory()), (8, 18))
    return image


def _draw_box(image: ImageRgb, box_xyxy_px: FloatArray, observation: PersonObservation) -> None:
    left, top, right, bottom = box_xyxy_px.round().astype(int).tolist()
    colour = awareness_colour(observation.awareness)
    cv2.rectangle(image, (left, top), (right, bottom), colour, 1, cv2.LINE_AA)
    alpha, spread = observation.awareness, observation.awareness_std
    text = "no face seen"
    if alpha is not None and spread is not None:
        text = f"α {alpha:.2f} ± {spread:.2f}"
    _write(image, [text], (left + 4, max(top - 4, 18)))


@dataclass(frozen=True, slots=True, eq=False)
class ShownRequest:
    """A request to a person or its answer, as a drawing shows it.

    Attributes:
        track_id: the person.
        text: ``"asks by voice: wins 2.1 s"`` or ``"looked after 0.9 s"``.
        answered: whether it is an answer.
        place_odom_m: (2,) place of the person now; None if the robot no longer has one.
    """

    track_id: int
    text: str
    answered: bool
    place_odom_m: FloatArray | None


class RequestMemory:
    """The requests and answers of the last 2 s, one per person, and everybody's latest look.

    Each is in one control cycle only, so :meth:`take` must get every cycle, drawn or not. A cycle
    that it gets again changes nothing.
    """

    def __init__(self) -> None:
        self._latest: dict[int, tuple[float, Alert | Answer]] = {}
        self._looked_s: dict[int, float] = {}

    def take(self, frame: CrossingFrame) -> None:
        """Remember the requests, answers and looks of a control cycle."""
        self._looked_s |= {
            each.id: frame.t_s for each in frame.tracks if each.awareness >= _LOOKS_FROM
        }
        limit = frame.constraints
        asked = [each for each in limit.alerts if each.kind == "attention"]
        events: tuple[Alert | Answer, ...] = (*asked, *limit.answers)
        for each in events:
            self._latest[each.track_id] = (frame.t_s, each)

    def noticed_s(self, obstacle: PersonObstacle, frame: CrossingFrame) -> float | None:
        """Return how long ago a person looked at the robot, if that counts and not α itself."""
        own = next((each for each in frame.tracks if each.id == obstacle.track_id), None)
        if own is None or not own.noticed or obstacle.awareness_lower <= own.awareness_lower:
            return None
        return frame.t_s - self._looked_s.get(own.id, frame.t_s)

    def shown(self, frame: CrossingFrame) -> tuple[ShownRequest, ...]:
        """Return what is shown at the time of a control cycle, the oldest first."""
        places = {each.id: each.position_odom_m for each in frame.tracks}
        places.update((each.track_id, each.center_odom_m) for each in frame.constraints.obstacles)
        return tuple(
            ShownRequest(who, _event_text(event), isinstance(event, Answer), places.get(who))
            for who, (t_s, event) in sorted(self._latest.items(), key=lambda item: item[1][0])
            if frame.t_s - t_s <= SHOWN_S
        )


def _event_text(event: Alert | Answer) -> str:
    if isinstance(event, Answer):
        return f"looked after {event.after_s:.1f} s"
    return f"asks by {event.means}: wins {event.wins_s:.1f} s"


class TopView:
    """A map of the hall from above: odom x to the right, y up.

    A request for attention is a line to the person with two rings and its text for 2 s, an answer
    two green rings. Each is in one control cycle, so :meth:`watch` gets the cycles that are not
    drawn.

    Args:
        stage: the stage to draw.
        size_px: width and height.
        window_m: x_min, y_min, x_max, y_max of the visible part.
    """

    def __init__(
        self,
        stage: Stage,
        size_px: tuple[int, int],
        window_m: tuple[float, float, float, float],
    ) -> None:
        x_min, y_min, x_max, y_max = window_m
        self._scale = min(size_px[0] / (x_max - x_min), size_px[1] / (y_max - y_min))
        centre = 0.5 * np.array([x_min + x_max, y_min + y_max])
        self._offset = 0.5 * np.array(size_px) - self._scale * centre * (1.0, -1.0)
        self._background = np.full((size_px[1], size_px[0], 3), _BACKGROUND_COLOUR, np.uint8)
        for x0, y0, x1, y1 in stage.warehouse.obstacle_boxes_odom:
            corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
            cv2.fillConvexPoly(
                self._background,
                _fixed_point(self._pixels(corners)),
                _RACK_COLOUR,
                cv2.LINE_AA,
                _SHIFT,
            )
        self._robot_path: list[FloatArray] = []
        self._worker_paths: list[list[FloatArray]] = [[] for _ in stage.workers]
        #: Requests, answers and looks of the frames so far.
        self.memory = RequestMemory()

    def watch(self, frame: CrossingFrame) -> None:
        """Remember requests, answers and looks of a frame, for the next ones that are drawn."""
        self.memory.take(frame)

    def _pixels(self, points_odom_m: FloatArray) -> FloatArray:
        return np.asarray(points_odom_m * (self._scale, -self._scale) + self._offset)

    def draw(self, frame: CrossingFrame, stage: Stage, cone: AttentionCone) -> ImageRgb:
        """Draw one frame; the paths grow with every call."""
        self.watch(frame)
        image: ImageRgb = self._background.copy()
        state = frame.robot_state
        self._robot_path.append(state.position_odom_m)
        draw_line(image, self._pixels(np.array(self._robot_path)), _ROBOT_COLOUR, 1)
        for path, view in zip(self._worker_paths, frame.truth, strict=True):
            path.append(view.position_odom_m)
            draw_line(image, self._pixels(np.array(path)), _PATH_COLOUR, 1)
        for obstacle in frame.constraints.obstacles:
            colour = awareness_colour(obstacle.awareness_lower)
            outline = self._pixels(np.asarray(obstacle.polygon.exterior.coords)[:, :2])
            _fill(image, outline, colour, 0.22)
            cv2.polylines(image, [_fixed_point(outline)], True, colour, 1, cv2.LINE_AA, _SHIFT)
        _mark(image, self._pixels(frame.scan_points_odom_m), _SCAN_COLOUR)
        for worker, view in zip(stage.workers, frame.truth, strict=True):
            eyes = worker.eyes_odom_m[:2]
            gaze = (frame.T_odom_camera[:3, :3] @ view.gaze_camera)[:2]
            heading = math.atan2(gaze[1], gaze[0])
            angles = np.linspace(-cone.half_angle_rad, cone.half_angle_rad, 15) + heading
            arc = eyes + 1.1 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
            sector = self._pixels(np.vstack([eyes, arc]))
            _fill(image, sector, awareness_colour(view.awareness), 0.3)
            centre = self._pixels(view.position_odom_m[None])
            draw_disc(image, centre, _PERSON_RADIUS_M * self._scale, _TEXT_COLOUR)
        heading = state.heading_odom_rad
        rotation = np.array(
            [[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]]
        )
        outline = self._pixels(stage.amr.profile.footprint_m @ rotation.T + state.position_odom_m)
        cv2.fillConvexPoly(image, _fixed_point(outline), _ROBOT_COLOUR, cv2.LINE_AA, _SHIFT)
        nose = np.stack([state.position_odom_m, state.position_odom_m + 0.7 * rotation[:, 0]])
        draw_line(image, self._pixels(nose), _ROBOT_COLOUR, 2)
        for each in self.memory.shown(frame):
            self._draw_request(image, each, state.position_odom_m)
        self._draw_scale(image)
        return image

    def _draw_request(
        self, image: ImageRgb, request: ShownRequest, robot_odom_m: FloatArray
    ) -> None:
        if request.place_odom_m is None:
            return
        place = self._pixels(request.place_odom_m)
        colour = awareness_colour(1.0) if request.answered else _ROBOT_COLOUR
        if not request.answered:
            draw_line(image, np.stack([self._pixels(robot_odom_m), place]), colour, 1)
        angles = np.linspace(0.0, 2.0 * math.pi, 49)
        for radius_m in _WAVES_M:
            ring = np.stack([np.cos(angles), np.sin(angles)], axis=1) * radius_m * self._scale
            draw_line(image, place + ring, colour, 2)
        width, height = _FONT.width_px(request.text), _FONT.height_px
        above = place - np.array([0.5 * width, _WAVES_M[1] * self._scale + height])
        most = np.maximum((4.0, 18.0), (image.shape[1] - width - 8.0, image.shape[0] - 8.0))
        left, top = np.clip(above, (4.0, 18.0), most).round().astype(int).tolist()
        _write(image, [request.text], (left, top))

    def _draw_scale(self, image: ImageRgb) -> None:
        y_px = image.shape[0] - 14.0
        draw_line(image, np.array([[14.0, y_px], [14.0 + self._scale, y_px]]), _TEXT_COLOUR, 2)
        _write(image, ["1 m"], (16, image.shape[0] - 18))


def _captions(frame: CrossingFrame, memory: RequestMemory) -> list[str]:
    limit = frame.constraints
    lines = [
        f"{frame.t_s:5.2f} s   robot {frame.robot_state.travel_mps:.2f} m/s",
        f"limit {limit.speed_limit_mps:.2f} m/s: {limit.limited_by}",
    ]
    return lines + [
        f"person {obstacle.track_id}: {_known(obstacle, memory.noticed_s(obstacle, frame))}, "
        f"radius {obstacle.radius_m:.2f} m"
        for obstacle in limit.obstacles
    ]


def _known(obstacle: PersonObstacle, noticed_s: float | None) -> str:
    """Return what the robot takes a person to know of it."""
    if noticed_s is None:
        return f"α ≥ {obstacle.awareness_lower:.2f}"
    return f"noticed {noticed_s:.1f} s ago, counts as {obstacle.awareness_lower:.2f}"


def _cone_rim(apex: FloatArray, gaze: FloatArray, half_angle_rad: float) -> FloatArray:
    """Return 24 points (24, 3) on the rim of an attention cone, cut off at the drawn length."""
    side = np.cross(gaze, [0.0, 0.0, 1.0] if abs(gaze[2]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    angles = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)[:, None]
    ring = np.cos(angles) * side + np.sin(angles) * np.cross(gaze, side)
    radius = _CONE_LENGTH_M * math.tan(half_angle_rad)
    return np.asarray(apex + _CONE_LENGTH_M * gaze + radius * ring)


def _drawable(points_px: FloatArray) -> bool:
    return bool(np.isfinite(points_px).all() and np.abs(points_px).max() < _FAR_PX)


def _mark(image: ImageRgb, points_px: FloatArray, colour: tuple[int, int, int]) -> None:
    """Draw each point (N, 2) as a square of two pixels, where it is in the image."""
    cells = np.round(points_px).astype(int)
    for shift in ((0, 0), (1, 0), (0, 1), (1, 1)):
        x, y = (cells + shift).T
        inside = (x >= 0) & (y >= 0) & (x < image.shape[1]) & (y < image.shape[0])
        image[y[inside], x[inside]] = colour


def _fill(image: ImageRgb, points_px: FloatArray, colour: Any, opacity: float) -> None:
    """Blend the convex hull of points (N, 2) into the image."""
    hull = cv2.convexHull(points_px.astype(np.float32))
    layer = image.copy()
    cv2.fillConvexPoly(layer, _fixed_point(hull.reshape(-1, 2)), colour, cv2.LINE_AA, _SHIFT)
    cv2.addWeighted(layer, opacity, image, 1.0 - opacity, 0.0, dst=image)


def _write(image: ImageRgb, lines: list[str], corner: tuple[int, int]) -> None:
    """Write lines of text on a plate; ``corner`` is the lower left one of the first line."""
    height = _FONT.height_px
    left, top = corner[0], corner[1] - height
    plate = image[max(top, 0) : top + height * len(lines) + 4, max(left - 4, 0) :]
    plate = plate[:, : max(_FONT.width_px(text) for text in lines) + 8]
    np.copyto(plate, (0.25 * plate + 0.75 * np.array(_BACKGROUND_COLOUR)).astype(np.uint8))
    for row, text in enumerate(lines):
        _FONT.write(image, text, (left, top + height * row + 1), _TEXT_COLOUR)


def _fixed_point(points_px: Any) -> NDArray[np.int32]:
    fixed: NDArray[np.int32] = np.round(points_px * (1 << _SHIFT)).astype(np.int32)
    return fixed.reshape(-1, 1, 2)
