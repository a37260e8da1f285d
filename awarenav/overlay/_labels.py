"""Labels of people in a picture: distance, α or why there is none."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from perception import Camera, PersonKeypoints, PersonObservation
from perception import layouts as kp
from perception.arrays import FloatArray, ImageRgb
from tracking import PersonTrack

from ..drawing import WHITE, Colour, Font, awareness_colour, darken_box, draw_line
from ._places import Box, Labelled, Place, Size, leader, meet, place_labels

#: Keypoints with a lower score are not seen.
SEEN_SCORE: Final = 0.3
#: Keypoints of a head.
HEAD: Final = range(kp.NOSE, kp.RIGHT_EAR + 1)


@dataclass(slots=True)
class OverlaidPerson:
    """A person to draw, and what is known of them.

    ``arrow_px`` (2, 2) is the gaze, from the head on; None until it is drawn.
    """

    observation: PersonObservation
    keypoints: PersonKeypoints | None = None
    track: PersonTrack | None = None
    arrow_px: FloatArray | None = None


def draw_labels(
    image: ImageRgb, near_first: Sequence[OverlaidPerson], camera: Camera, font: Font, caption: str
) -> None:
    """Draw a label at each person and a caption in a corner; they hide no head and no other label.

    A label far from its head has a line to it. Somebody for whom there is no room has none.

    Args:
        image: (H, W, 3) uint8 RGB, which is changed.
        near_first: the people, the nearest first.
        camera: of the image.
        font: of the labels.
        caption: of the picture; empty for none.
    """
    picture = image.shape[1], image.shape[0]
    labelled = [_labelled(person, camera, font, picture) for person in near_first]
    taken = []
    if caption:
        taken.append(_draw_caption(image, caption, font, [each.head for each in labelled]))
    places = place_labels(labelled, picture, taken)
    for person, place, own in zip(near_first, places, labelled, strict=True):
        if place is not None:
            ends = leader(place.box, own.head)
            if math.dist(*ends) > font.height_px:
                draw_line(image, ends, awareness_colour(person.observation.awareness), 1)
            _draw_label(image, person, place, font)


def _texts(person: OverlaidPerson) -> tuple[tuple[str, ...], ...]:
    """Return the rows of a person's label, the smallest label first."""
    observation, track = person.observation, person.track
    alpha, spread = observation.awareness, observation.awareness_std
    name = "" if track is None else f"#{track.id} "
    distance = f"{np.linalg.norm(observation.position_camera_m):.1f} m"
    distance = distance if track is None else f"#{track.id} · {distance}"
    if alpha is None:
        why = observation.awareness_reason or "no evidence"
        return (f"{name}no α",), (f"{name}{why}",), (distance, f"no α: {why}")
    value = f"α {alpha:.2f}"
    return (f"{name}{value}",), (distance, f"{value} ± {spread:.2f}")


def _labelled(person: OverlaidPerson, camera: Camera, font: Font, picture: Size) -> Labelled:
    """Return where a person and their head are, and how large their label is."""
    box = person.observation.box_xyxy_px
    if box is None:
        u, v = camera.project(person.observation.position_camera_m[None])[0].tolist()
        box = np.array([u, v, u, v]) if math.isfinite(u) else np.zeros(4)
    return Labelled(
        _inside(box, picture),
        _inside(_head_px(box, person.keypoints), picture),
        _label_sizes(person, font),
        None if person.arrow_px is None else _inside(_around(person.arrow_px), picture),
    )


def _head_px(box: FloatArray, keypoints: PersonKeypoints | None) -> FloatArray:
    """Return the box (4,) around a person's top fifth and the keypoints of the head.

    Somebody bent has the head elsewhere than at the top, and keypoints may be a neighbour's.
    """
    height = box[3] - box[1]
    top = np.array([box[:2], (box[2], box[1] + 0.2 * height)])
    if keypoints is None:
        return _around(top)
    points = keypoints.keypoints_px[list(HEAD)][keypoints.scores[list(HEAD)] >= SEEN_SCORE]
    if not len(points):
        return _around(top)
    low, high = points.min(axis=0), points.max(axis=0)
    # From ear to ear a head is two thirds of its height; a profile shows less.
    margin = max(0.75 * float((high - low).max()), 0.06 * height)
    return _around(np.vstack([top, low - margin, high + margin]))


def _around(points: FloatArray) -> FloatArray:
    return np.concatenate([points.min(axis=0), points.max(axis=0)])


def _inside(box: FloatArray, picture: Size) -> Box:
    """Return the part of a box (4,) in the picture, in whole pixels."""
    clipped = np.clip(np.nan_to_num(box), 0.0, (*picture, *picture))
    left, top = np.floor(clipped[:2]).astype(int).tolist()
    right, bottom = np.ceil(clipped[2:]).astype(int).tolist()
    return left, top, right, bottom


def _label_sizes(person: OverlaidPerson, font: Font) -> tuple[Size, ...]:
    """Return the sizes of a person's labels, the smallest first."""
    gap, sizes = _label_gap(font), []
    for rows in _texts(person):
        width = max(font.width_px(row) for row in rows) + 2 * gap
        height = len(rows) * font.height_px + gap
        sizes.append((width, height + _bar_height(person, rows, font)))
    return tuple(sizes)


def _label_gap(font: Font) -> int:
    return max(font.height_px // 4, 3)


def _bar_height(person: OverlaidPerson, rows: Sequence[str], font: Font) -> int:
    """Return the height of the bar with its margin: a whole label with an α has one."""
    has_bar = len(rows) > 1 and person.observation.awareness is not None
    return 2 * _label_gap(font) if has_bar else 0


def _draw_label(image: ImageRgb, person: OverlaidPerson, place: Place, font: Font) -> None:
    """Draw α, why there is none, or all: the distance and a bar as well."""
    left, top, right, bottom = place.box
    gap, rows = _label_gap(font), _texts(person)[place.size]
    darken_box(image, place.box)
    colour = awareness_colour(person.observation.awareness)
    _fill_box(image, (left, top, left + max(gap // 2, 2), bottom), colour)
    for number, row in enumerate(rows):
        corner = left + gap, top + gap // 2 + number * font.height_px
        font.write(image, row, corner, WHITE)
    if _bar_height(person, rows, font):
        bar = (left + gap, bottom - 2 * gap, right - gap, bottom - gap)
        _draw_bar(image, bar, person.observation, person.track)


def _draw_bar(
    image: ImageRgb, bar: Box, observation: PersonObservation, track: PersonTrack | None
) -> None:
    """Draw α, its standard deviation and the lower bound on a scale from 0 to 1."""
    left, top, right, bottom = bar
    span, height = right - left, bottom - top
    _fill_box(image, bar, (74, 78, 88))
    alpha, spread = observation.awareness, observation.awareness_std
    if alpha is not None and spread is not None:
        colour = awareness_colour(alpha)
        low, high = max(alpha - spread, 0.0), min(alpha + spread, 1.0)
        faint = tuple((np.array(colour) * 0.55 + 30.0).astype(int).tolist())
        _fill_box(image, (left, top, left + round(alpha * span), bottom), colour)
        band = (
            left + round(low * span),
            top + height // 3,
            left + max(round(high * span), round(low * span) + 1),
            bottom - height // 3,
        )
        _fill_box(image, band, (faint[0], faint[1], faint[2]))
    if track is not None:
        mark = left + round(track.awareness_lower * (span - 2))
        _fill_box(image, (mark, top - 2, mark + 2, bottom + 2), WHITE)


def _fill_box(image: ImageRgb, box: Box, colour: Colour) -> None:
    left, top, right, bottom = box
    image[max(top, 0) : max(bottom, 0), max(left, 0) : max(right, 0)] = colour


def _draw_caption(image: ImageRgb, text: str, font: Font, heads: Sequence[Box]) -> Box:
    """Write a line into a corner of the picture without heads; return its box."""
    gap = font.height_px // 3
    width, height = font.width_px(text) + 3 * gap, font.height_px + gap
    right, bottom = image.shape[1] - width, image.shape[0] - height
    corners = [(0, bottom), (0, 0), (right, 0), (right, bottom)]
    boxes = [(left, top, left + width, top + height) for left, top in corners]
    free = (box for box in boxes if not any(meet(box, head) for head in heads))
    box = next(free, boxes[0])
    darken_box(image, box, 0.55)
    font.write(image, text, (box[0] + gap, box[1] + gap // 2), WHITE)
    return box
