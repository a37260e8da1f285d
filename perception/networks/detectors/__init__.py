"""Person detectors: networks that find people in an image, and what prepares their input."""

from __future__ import annotations

from ._detector import OnnxPersonDetector
from ._efficientdet import EfficientDetPersonDetector
from ._letterbox import Letterbox, LetterboxGeometry
from ._wide_view import for_wide_view

__all__ = [
    "EfficientDetPersonDetector",
    "Letterbox",
    "LetterboxGeometry",
    "OnnxPersonDetector",
    "for_wide_view",
]
