"""Person detectors: networks that find people in an image, and what prepares their input."""

from __future__ import annotations

from ._detector import OnnxPersonDetector
from ._letterbox import Letterbox, LetterboxGeometry

__all__ = ["Letterbox", "LetterboxGeometry", "OnnxPersonDetector"]
