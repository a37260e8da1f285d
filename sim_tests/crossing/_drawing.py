"""Drawings of a crossing: annotated camera images, and a map from above."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np

from awarenav.drawing import (
    Colour,
    Font,
    awareness_colour,
    draw_disc,
    draw_line,
    drawable,
    fill_hull,
)
from nav_adapter import Alert, PersonObstacle
from nav_adapter.alerts import Answer
from perception import AttentionCone, Camera, PersonObservation
from perception.arrays import FloatArray, ImageRgb

from ..world.camera import CameraRenderer
from ._messages import NOBODY
from ._result import CrossingFrame
from ._stage import Stage, TrueView

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
_CONE: Final = AttentionCone()
_SECTOR_M: Final = 1.1
#: Time for which a request or an answer is shown.
SHOWN_S: Final = 2.0
_ANGLES: Final = np.linspace(0.0, 2.0 * math.pi, 49)
_CIRCLE: Final = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1)
# A person looks at the robot from this estimate of α on.
_LOOKS_FROM: Final = 0.5


def camera_view(frame: CrossingFrame, stage: Stage, width_px: int, **how: Any) -> ImageRgb:
    """Return what the robot's camera sees, as :func:`draw_camera_view` draws it."""
    spec = stage.scenario.camera
    camera = spec.camera(width_px / spec.width_px)
    picture = CameraRenderer(stage.warehouse).rgb(camera, frame.T_odom_camera)
    return draw_camera_view(picture, camera, frame, stage, **how)


def draw_camera_view(
    picture: ImageRgb,
    camera: Camera,
    frame: CrossingFrame,
    stage: Stage,
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
        ring = np.zeros((len(_CIRCLE), 3))
        ring[:, :2] = obstacle.center_odom_m + obstacle.radius_m * _CIRCLE
        colour = awareness_colour(obstacle.awareness_lower)
        for ends in itertools.pairwise(pixels(ring)):
            if drawable(np.array(ends)):
                draw_line(image, np.array(ends), colour, 2)
    for observation, worker in zip(frame.observations, frame.observed_workers, strict=True):
        colour = awareness_colour(observation.awareness)
        if observation.gaze_camera is not None and worker != NOBODY:
            eyes = stage.workers[worker].eyes_odom_m
            gaze = rotation @ observation.gaze_camera
            rim = pixels(np.vstack([eyes, _cone_rim(eyes, gaze)]))
            rim = rim[np.isfinite(rim).all(axis=1)]
            if len(rim) > 2 and drawable(rim):
                fill_hull(image, rim, colour, 0.16)
            axis = pixels(np.stack([eyes, eyes + _CONE_LENGTH_M * gaze]))
            if drawable(axis):
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


@dataclass(frozen=True, slots=True, eq=False)
class MapScale:
    """A part of the hall in a picture from above: odom x to the right, y up.

    Attributes:
        px_per_m: scale.
        centre_odom_m: (2,) place in the middle of the picture.
        size_px: width and height of the picture.
    """

    px_per_m: float
    centre_odom_m: FloatArray
    size_px: tuple[int, int]

    def px(self, points_odom_m: FloatArray) -> FloatArray:
        """Return the pixels (N, 2) of points (N, 2)."""
        shifted = (np.asarray(points_odom_m) - self.centre_odom_m) * self.px_per_m
        return np.asarray(shifted * (1.0, -1.0) + 0.5 * np.array(self.size_px))

    def hall(self, boxes_odom_m: FloatArray, floor: Colour, racks: Colour) -> ImageRgb:
        """Return a picture of the hall alone."""
        image: ImageRgb = np.full((self.size_px[1], self.size_px[0], 3), floor, np.uint8)
        for x0, y0, x1, y1 in boxes_odom_m:
            fill_hull(
                image, self.px(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])), racks, 1.0
            )
        return image

    def ring(self, centre_odom_m: FloatArray, radius_m: float) -> FloatArray:
        """Return the pixels (N, 2) of a circle."""
        return self.px(centre_odom_m + radius_m * _CIRCLE)

    def gaze(
        self, frame: CrossingFrame, view: TrueView, eyes_odom_m: FloatArray, radius_m: float
    ) -> FloatArray:
        """Return the pixels (N, 2) of the sector that a person's attention cone covers."""
        x, y = (frame.T_odom_camera[:2, :3] @ view.gaze_camera).tolist()
        half_rad = _CONE.half_angle_rad
        angles = np.linspace(-half_rad, half_rad, 15) + math.atan2(y, x)
        arc = eyes_odom_m + radius_m * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        return self.px(np.vstack([eyes_odom_m, arc]))

    def robot(self, frame: CrossingFrame, points_m: FloatArray) -> FloatArray:
        """Return the pixels (N, 2) of points (N, 2) of the robot's base frame."""
        heading = frame.robot_state.heading_odom_rad
        cos, sin = math.cos(heading), math.sin(heading)
        turned = points_m @ np.array([[cos, sin], [-sin, cos]])
        return self.px(turned + frame.robot_state.position_odom_m)


class TopView:
    """A map of the hall from above, of frame after frame.

    A request for attention is a line to the person with two rings and its text for 2 s, an answer
    two green rings. Each is in one control cycle, so :meth:`watch` gets the cycles that are not
    drawn.

    Args:
        stage: the stage to draw.
        size_px: width and height.
        window_m: x_min, y_min, x_max, y_max of the visible part.
    """

    def __init__(
        self, stage: Stage, size_px: tuple[int, int], window_m: tuple[float, float, float, float]
    ) -> None:
        low, high = np.array(window_m[:2]), np.array(window_m[2:])
        self._map = MapScale(float((size_px / (high - low)).min()), 0.5 * (low + high), size_px)
        boxes = stage.warehouse.obstacle_boxes_odom
        self._background = self._map.hall(boxes, _BACKGROUND_COLOUR, _RACK_COLOUR)
        self._robot_path: list[FloatArray] = []
        self._worker_paths: list[list[FloatArray]] = [[] for _ in stage.workers]
        #: Requests, answers and looks of the frames so far.
        self.memory = RequestMemory()

    def watch(self, frame: CrossingFrame) -> None:
        """Remember requests, answers and looks of a frame, for the next ones that are drawn."""
        self.memory.take(frame)

    def draw(self, frame: CrossingFrame, stage: Stage) -> ImageRgb:
        """Draw one frame; the paths grow with every call."""
        self.watch(frame)
        place = self._map
        image: ImageRgb = self._background.copy()
        robot_m = frame.robot_state.position_odom_m
        self._robot_path.append(robot_m)
        draw_line(image, place.px(np.array(self._robot_path)), _ROBOT_COLOUR, 1)
        for path, view in zip(self._worker_paths, frame.truth, strict=True):
            path.append(view.position_odom_m)
            draw_line(image, place.px(np.array(path)), _PATH_COLOUR, 1)
        for obstacle in frame.constraints.obstacles:
            colour = awareness_colour(obstacle.awareness_lower)
            outline = place.px(np.asarray(obstacle.polygon.exterior.coords)[:, :2])
            fill_hull(image, outline, colour, 0.22)
            draw_line(image, outline, colour, 1)
        _mark(image, place.px(frame.scan_points_odom_m), _SCAN_COLOUR)
        for worker, view in zip(stage.workers, frame.truth, strict=True):
            sector = place.gaze(frame, view, worker.eyes_odom_m[:2], _SECTOR_M)
            fill_hull(image, sector, awareness_colour(view.awareness), 0.3)
            centre = place.px(view.position_odom_m)
            draw_disc(image, centre, _PERSON_RADIUS_M * place.px_per_m, _TEXT_COLOUR)
        fill_hull(image, place.robot(frame, stage.amr.profile.footprint_m), _ROBOT_COLOUR, 1.0)
        nose = place.robot(frame, np.array([[0.0, 0.0], [0.7, 0.0]]))
        draw_line(image, nose, _ROBOT_COLOUR, 2)
        for each in self.memory.shown(frame):
            self._draw_request(image, each, robot_m)
        self._draw_scale(image)
        return image

    def _draw_request(
        self, image: ImageRgb, request: ShownRequest, robot_odom_m: FloatArray
    ) -> None:
        if request.place_odom_m is None:
            return
        place, scale = self._map.px(request.place_odom_m), self._map.px_per_m
        colour = awareness_colour(1.0) if request.answered else _ROBOT_COLOUR
        if not request.answered:
            draw_line(image, np.stack([self._map.px(robot_odom_m), place]), colour, 1)
        for radius_m in _WAVES_M:
            draw_line(image, self._map.ring(request.place_odom_m, radius_m), colour, 2)
        width, height = _FONT.width_px(request.text), _FONT.height_px
        above = place - np.array([0.5 * width, _WAVES_M[1] * scale + height])
        most = np.maximum((4.0, 18.0), (image.shape[1] - width - 8.0, image.shape[0] - 8.0))
        left, top = np.clip(above, (4.0, 18.0), most).round().astype(int).tolist()
        _write(image, [request.text], (left, top))

    def _draw_scale(self, image: ImageRgb) -> None:
        y_px = image.shape[0] - 14.0
        draw_line(
            image, np.array([[14.0, y_px], [14.0 + self._map.px_per_m, y_px]]), _TEXT_COLOUR, 2
        )
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


def _cone_rim(apex: FloatArray, gaze: FloatArray) -> FloatArray:
    """Return points (N, 3) on the rim of an attention cone, cut off at the drawn length."""
    side = np.cross(gaze, [0.0, 0.0, 1.0] if abs(gaze[2]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    ring = _CIRCLE[:-1, :1] * side + _CIRCLE[:-1, 1:] * np.cross(gaze, side)
    radius = _CONE_LENGTH_M * math.tan(_CONE.half_angle_rad)
    return np.asarray(apex + _CONE_LENGTH_M * gaze + radius * ring)


def _mark(image: ImageRgb, points_px: FloatArray, colour: tuple[int, int, int]) -> None:
    """Draw each point (N, 2) as a square of two pixels, where it is in the image."""
    cells = np.round(points_px).astype(int)
    for shift in ((0, 0), (1, 0), (0, 1), (1, 1)):
        x, y = (cells + shift).T
        inside = (x >= 0) & (y >= 0) & (x < image.shape[1]) & (y < image.shape[0])
        image[y[inside], x[inside]] = colour


def _write(image: ImageRgb, lines: list[str], corner: tuple[int, int]) -> None:
    """Write lines of text on a plate; ``corner`` is the lower left one of the first line."""
    height = _FONT.height_px
    left, top = corner[0], corner[1] - height
    plate = image[max(top, 0) : top + height * len(lines) + 4, max(left - 4, 0) :]
    plate = plate[:, : max(_FONT.width_px(text) for text in lines) + 8]
    np.copyto(plate, (0.25 * plate + 0.75 * np.array(_BACKGROUND_COLOUR)).astype(np.uint8))
    for row, text in enumerate(lines):
        _FONT.write(image, text, (left, top + height * row + 1), _TEXT_COLOUR)
