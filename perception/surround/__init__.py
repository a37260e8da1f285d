"""Cameras that see to the side and behind: fisheye lenses and panoramas, cut into flat views.

A pinhole picture ends before 180°, and a person who has left it is no longer known to be aware. One
picture of a wider lens is cut into flat (pinhole) views about the same optical centre. Each goes
through an :class:`~perception.AwarenessPipeline`, and whoever shows in two neighbours is reported
once, in the frame of the camera::

    lens = PanoramaLens(3840, 1920)
    flat = Camera.from_fov(1584, 1200, math.radians(110))
    views = ring_of_views(flat, np.radians([0, 90, 180, -90]))
    pipeline = SurroundPipeline(lens, views)
    observations = pipeline.process(image_rgb, stamp_s)

:class:`tracking.SurroundView` tells a tracker where such a camera can see.
"""

from ._lenses import FisheyeLens, PanoramaLens, WideLens
from ._merging import SeenInView, merge_views
from ._pipeline import SurroundPipeline
from ._views import FlatView, ring_of_views

__all__ = [
    "FisheyeLens",
    "FlatView",
    "PanoramaLens",
    "SeenInView",
    "SurroundPipeline",
    "WideLens",
    "merge_views",
    "ring_of_views",
]
