"""Places for the labels of people in a picture, where they hide no head and no other label."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

# Left, top, right, bottom in pixels.
Box = tuple[int, int, int, int]
#: Width and height in pixels.
Size = tuple[int, int]

# Between a label and what it belongs to.
_GAP_PX: Final = 2


@dataclass(frozen=True, slots=True)
class Labelled:
    """A person who gets a label.

    Attributes:
        box: around the person.
        head: around the head, which no label hides.
        sizes: of the label, the smallest first.
        pointer: around what points from the head, which a label leaves alone where it can.
    """

    box: Box
    head: Box
    sizes: tuple[Size, ...]
    pointer: Box | None = None


@dataclass(frozen=True, slots=True)
class Place:
    """A place of a label.

    Attributes:
        box: of the label, inside the picture.
        size: index in ``sizes`` of the person.
    """

    box: Box
    size: int


def place_labels(
    people: Sequence[Labelled], picture: Size, taken: Sequence[Box] = ()
) -> list[Place | None]:
    """Return the place of each label; None where there is no room even for the smallest.

    No label meets a head, another label or what is taken. Each is near its own head, and leaves
    bodies and pointers alone where it can. Everybody gets the smallest size first; then labels
    grow, in the order of the people.

    Args:
        people: the most important first.
        picture: its size.
        taken: places that stay free.
    """
    places: list[Place | None] = [None] * len(people)
    for size in range(max((len(each.sizes) for each in people), default=0)):
        for index, person in enumerate(people):
            if size < len(person.sizes):
                places[index] = _best(people, index, size, places, picture, taken) or places[index]
    # Small labels of others were in the way while the first ones grew.
    again: list[Place | None] = [None] * len(people)
    for index, place in enumerate(places):
        if place is not None:
            again[index] = _best(people, index, place.size, again, picture, taken)
    return again if again.count(None) == places.count(None) else places


def _best(
    people: Sequence[Labelled],
    index: int,
    size: int,
    places: Sequence[Place | None],
    picture: Size,
    taken: Sequence[Box],
) -> Place | None:
    """Return the best free place of one person's label in a size; None if there is no room."""
    others = [place.box for k, place in enumerate(places) if place and k != index]
    forbidden = [*(each.head for each in people), *others, *taken]
    unwanted = [each.box for each in people]
    unwanted += [each.pointer for each in people if each.pointer is not None]
    free = [
        box
        for box in _candidates(people[index], people[index].sizes[size], picture)
        if not any(meet(box, other) for other in forbidden)
    ]
    if not free:
        return None
    return Place(min(free, key=lambda box: _strain(box, people[index].head, unwanted)), size)


def meet(one: Box, other: Box) -> bool:
    """Return whether two boxes have a pixel in common."""
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def leader(label: Box, head: Box) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the ends of the shortest line from a label to a head."""
    (x_label, x_head), (y_label, y_head) = (
        _nearest((label[k], label[2 + k]), (head[k], head[2 + k])) for k in (0, 1)
    )
    return (x_label, y_label), (x_head, y_head)


def _nearest(one: tuple[int, int], other: tuple[int, int]) -> tuple[int, int]:
    """Return the nearest numbers of two intervals; of what they share, the middle."""
    if one[1] < other[0]:
        return one[1], other[0]
    if other[1] < one[0]:
        return one[0], other[1]
    middle = (max(one[0], other[0]) + min(one[1], other[1])) // 2
    return middle, middle


def _strain(label: Box, head: Box, unwanted: Sequence[Box]) -> float:
    """Return how far a label is from its head, and farther for what it hides."""
    away = math.dist(*leader(label, head))
    return away + (label[3] - label[1]) * sum(meet(label, other) for other in unwanted)


def _candidates(person: Labelled, size: Size, picture: Size) -> Iterator[Box]:
    """Yield places inside the picture: above, beside, below, and on the body."""
    (left, top, right, bottom), (width, height) = person.box, size
    if width > picture[0] or height > picture[1]:
        return
    chest = person.head[3] + _GAP_PX
    across = ((left + right - width) // 2, left, right - width)
    beside = (top, chest, (top + bottom - height) // 2, bottom - height)
    corners = [(x, top - height - _GAP_PX) for x in across]
    corners += [(x, y) for y in beside for x in (right + _GAP_PX, left - width - _GAP_PX)]
    corners += [(x, bottom + _GAP_PX) for x in across]
    corners += [(x, y) for y in (bottom - height - _GAP_PX, chest) for x in across]
    for x, y in corners:
        inside = min(max(x, 0), picture[0] - width), min(max(y, 0), picture[1] - height)
        yield (*inside, inside[0] + width, inside[1] + height)
