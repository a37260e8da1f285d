"""ONNX Runtime, told to keep what it sees to itself.

Its newer Linux wheels report processes, sessions and models to their maker from the moment of
the import (microsoft/onnxruntime#27379), and leave an identifier on the disk. A robot does neither
unless its owner says so: ``ORT_DISABLE_TELEMETRY`` is set unless it is set already.
"""

from __future__ import annotations

import os

os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")

import onnxruntime as ort  # type: ignore[import-untyped]

__all__ = ["ort"]
