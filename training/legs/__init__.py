"""Training of the classifier of legs in laser scans; README.md in this folder says how."""

from __future__ import annotations

from ._scenes import TRAINING_HALLS, TRAINING_WORKERS

__all__ = ["TRAINING_HALLS", "TRAINING_WORKERS"]
