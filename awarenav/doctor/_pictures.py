"""Figures of a camera's pictures, and findings about them: exposure, sharpness, repetition."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np

from perception.arrays import ImageRgb

from ._findings import Finding

# Grey levels from which on a pixel is burnt out, and below which it is black.
_BURNT: Final = 250
_BLACK: Final = 8
# Shares of such pixels, of a picture in which faces may be lost.
_BURNT_SHARE: Final = 0.25
_BLACK_SHARE: Final = 0.5
# A picture with less than this between its first and last hundredth shows nothing.
_EMPTY_LEVELS: Final = 12.0
# Strong edges wider than this are blurred: a sharp one is two pixels wide.
_WIDE_EDGE_PX: Final = 5.0
# The edges of a picture are measured on this share of its pixels.
_STRONGEST: Final = 99.9


@dataclass(frozen=True, slots=True)
class PictureFigures:
    """Figures of one picture.

    Attributes:
        burnt: share of pixels that are burnt out.
        black: share of pixels that are black.
        levels: grey levels between the darkest and the brightest hundredth of the pixels.
        edge_px: width of the strongest edges; 2 is sharp.
        repeats: the picture is the one before, to the bit.
    """

    burnt: float
    black: float
    levels: float
    edge_px: float
    repeats: bool


def picture_figures(image_rgb: ImageRgb, before_rgb: ImageRgb | None = None) -> PictureFigures:
    """Return the figures of a picture.

    Args:
        image_rgb: (H, W, 3) uint8.
        before_rgb: the picture before it.
    """
    grey = cv2.cvtColor(np.ascontiguousarray(image_rgb), cv2.COLOR_RGB2GRAY)
    low, high = np.percentile(grey, (1.0, 99.0)).tolist()
    level = grey.astype(np.float32)
    # Central differences: a step over one pixel gives half its height on both sides.
    across = 0.5 * np.abs(level[:, 2:] - level[:, :-2]) if grey.shape[1] > 2 else np.zeros(1)
    slope = float(np.percentile(across, _STRONGEST))
    return PictureFigures(
        burnt=float(np.mean(grey >= _BURNT)),
        black=float(np.mean(grey <= _BLACK)),
        levels=high - low,
        edge_px=(high - low) / slope if slope > 0.0 else np.inf,
        repeats=before_rgb is not None and np.array_equal(image_rgb, before_rgb),
    )


def picture_findings(figures: Sequence[PictureFigures]) -> list[Finding]:
    """Return the findings about the pictures of one camera, in the order of time."""
    burnt, black, levels, edge_px = (
        float(np.median([getattr(each, name) for each in figures]))
        for name in ("burnt", "black", "levels", "edge_px")
    )
    repeats = sum(each.repeats for each in figures)
    if levels < _EMPTY_LEVELS:
        return [
            Finding.error(
                "images",
                f"they show nothing: {levels:.0f} grey levels between dark and bright",
                "take the cap off the lens; check the exposure and the cable",
            )
        ]
    found = []
    if repeats and repeats == len(figures) - 1:
        found.append(
            Finding.error(
                "images",
                f"all {len(figures)} are identical, bit for bit: the camera is frozen",
                "restart the driver; a live camera has noise",
            )
        )
    elif repeats:
        found.append(
            Finding.warning(
                "images",
                f"{repeats} of {len(figures)} repeat the one before",
                "check the driver's frame rate and the load on the computer",
            )
        )
    found.append(_exposure(burnt, black))
    if edge_px > _WIDE_EDGE_PX:
        found.append(
            Finding.warning(
                "sharpness",
                f"the sharpest edges are {edge_px:.1f} pixels wide: out of focus, or in motion",
                "focus, clean the lens, or use a shorter exposure",
            )
        )
    else:
        found.append(Finding.fine("sharpness", f"edges {edge_px:.1f} pixels wide; 2 is sharp"))
    return found


def _exposure(burnt: float, black: float) -> Finding:
    if burnt > _BURNT_SHARE:
        return Finding.warning(
            "exposure",
            f"{100.0 * burnt:.0f} % of the pixels are burnt out",
            "use a shorter exposure; faces in front of a window need it most",
        )
    if black > _BLACK_SHARE:
        return Finding.warning(
            "exposure",
            f"{100.0 * black:.0f} % of the pixels are black",
            "more light, or a longer exposure",
        )
    shares = f"{100.0 * burnt:.0f} % burnt out, {100.0 * black:.0f} % black"
    return Finding.fine("exposure", shares)
