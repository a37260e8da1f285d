"""Keypoint layouts: names and order of the keypoints in arrays.

The first 17 keypoints of COCO-WholeBody are those of COCO, so the indices below hold for both. The
neck is not a keypoint of either; it is the midpoint of the shoulders.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from .errors import PerceptionError

COCO_NAMES: Final[tuple[str, ...]] = (
    "nose",
    "left_eye",
    "right_eye",
    "left_ear",
    "right_ear",
    "left_shoulder",
    "right_shoulder",
    "left_elbow",
    "right_elbow",
    "left_wrist",
    "right_wrist",
    "left_hip",
    "right_hip",
    "left_knee",
    "right_knee",
    "left_ankle",
    "right_ankle",
)  # fmt: skip
FOOT_NAMES: Final[tuple[str, ...]] = (
    "left_big_toe",
    "left_small_toe",
    "left_heel",
    "right_big_toe",
    "right_small_toe",
    "right_heel",
)
_WHOLEBODY_NAMES: Final[tuple[str, ...]] = (
    *COCO_NAMES,
    *FOOT_NAMES,
    *(f"face_{index}" for index in range(68)),
    *(f"left_hand_{index}" for index in range(21)),
    *(f"right_hand_{index}" for index in range(21)),
)

NOSE, LEFT_EYE, RIGHT_EYE, LEFT_EAR, RIGHT_EAR = range(5)
LEFT_SHOULDER, RIGHT_SHOULDER, LEFT_ELBOW, RIGHT_ELBOW, LEFT_WRIST, RIGHT_WRIST = range(5, 11)
LEFT_HIP, RIGHT_HIP, LEFT_KNEE, RIGHT_KNEE, LEFT_ANKLE, RIGHT_ANKLE = range(11, 17)

#: Rows of the head (nose, eyes, ears) and of COCO's 17 keypoints.
HEAD: Final = slice(NOSE, RIGHT_EAR + 1)
BODY: Final = slice(NOSE, RIGHT_ANKLE + 1)
#: Rows of pairs, the left one first.
SHOULDERS: Final = slice(LEFT_SHOULDER, RIGHT_SHOULDER + 1)
HIPS: Final = slice(LEFT_HIP, RIGHT_HIP + 1)
ANKLES: Final = slice(LEFT_ANKLE, RIGHT_ANKLE + 1)


@dataclass(frozen=True, slots=True)
class KeypointLayout:
    """A named order of keypoints.

    Attributes:
        name: name of the layout.
        names: names of the keypoints, in the order of the rows.
    """

    name: str
    names: tuple[str, ...]
    _index: dict[str, int] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_index", {name: row for row, name in enumerate(self.names)})

    @property
    def size(self) -> int:
        """Number of keypoints."""
        return len(self.names)

    def index(self, name: str) -> int:
        """Return the row of the keypoint called ``name``.

        Raises:
            PerceptionError: for a name that the layout does not have.
        """
        try:
            return self._index[name]
        except KeyError:
            raise PerceptionError(
                f"layout {self.name!r} has no keypoint {name!r}; "
                f"it has {', '.join(self.names[:17])}…"
            ) from None


_LAYOUTS: Final[dict[str, KeypointLayout]] = {
    "coco": KeypointLayout("coco", COCO_NAMES),
    "coco_wholebody": KeypointLayout("coco_wholebody", _WHOLEBODY_NAMES),
}


def keypoint_layout(name: str) -> KeypointLayout:
    """Return the layout called ``name``: ``"coco"`` (17) or ``"coco_wholebody"`` (133).

    Raises:
        PerceptionError: for another name.
    """
    try:
        return _LAYOUTS[name]
    except (KeyError, TypeError):
        raise PerceptionError(
            f"layout must be one of {', '.join(map(repr, _LAYOUTS))}, got {name!r}"
        ) from None
