"""Strict pydantic models that read and write YAML: :mod:`perception.config` with this error."""

from __future__ import annotations

from typing import ClassVar

import perception.config
from perception.config import complaint, complaints, other_kind

from ._errors import TrackingError

__all__ = ["StrictConfig", "complaint", "complaints", "other_kind"]


class StrictConfig(perception.config.StrictConfig):
    """Base of every config: frozen, with finite numbers only; unknown keys are refused by name."""

    error: ClassVar[type[ValueError]] = TrackingError
