"""Person detectors: networks that find people in an image, and what prepares their input."""

from __future__ import annotations

from ._box_format import BoxFormatVote
from ._detector import OnnxPersonDetector
from ._letterbox import Letterbox, LetterboxGeometry

__all__ = ["BoxFormatVote", "Letterbox", "LetterboxGeometry", "OnnxPersonDetector"]
