"""What one picture says about the people in it, with what it was concluded from."""

from __future__ import annotations

from dataclasses import dataclass

from perception import Camera, PersonKeypoints, PersonObservation
from perception.arrays import FloatArray
from tracking import PersonTrack

from ._source_frame import SourceFrame


@dataclass(frozen=True, slots=True, eq=False)
class FrameEstimate:
    """The estimate of one frame.

    Attributes:
        frame: the picture.
        camera: that took it.
        T_odom_camera: (4, 4) the pose that was used, or None when none was needed.
        observations: one a person.
        keypoints: of each observation's person; None where they are not known.
        tracks: everybody who is followed, or None when nobody is followed.
        track_ids: of each observation, the track that took it; None when nobody is followed.
    """

    frame: SourceFrame
    camera: Camera
    T_odom_camera: FloatArray | None
    observations: tuple[PersonObservation, ...]
    keypoints: tuple[PersonKeypoints | None, ...]
    tracks: tuple[PersonTrack, ...] | None
    track_ids: tuple[int | None, ...]
