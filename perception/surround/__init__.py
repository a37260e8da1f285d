"""Cameras that see to the side and behind: fisheye and panorama images, cut into flat views.

A pinhole image covers less than 180°, and a person outside it no longer counts as aware. Here an
image of a wider lens is cut into flat (pinhole) views from the same optical centre. An
:class:`~perception.AwarenessPipeline` processes each view. A person who appears in two views is
reported once, in the camera frame::

    lens = PanoramaLens(3840, 1920)
    flat = Camera.from_fov(1584, 1200, math.radians(110))
    views = ring_of_views(flat, np.radians([0, 90, 180, -90]))
    pipeline = SurroundPipeline(lens, views)
    observations = pipeline.process(image_rgb, stamp_s)

:class:`tracking.SurroundView` describes the field of view of such a camera to a tracker.
"""

from __future__ import annotations

from ._lenses import FisheyeLens, FlatView, PanoramaLens, WideLens, ring_of_views
from ._pipeline import SeenInView, SurroundPipeline, merge_views

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
