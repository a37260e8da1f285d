"""Crossings as a pytest suite: ``pytest --pyargs sim_tests --awarenav-planner MODULE:CLASS``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._thresholds import EpisodeThresholds, Thresholds

__all__ = ["EpisodeThresholds", "Thresholds"]

__getattr__ = lazy_names(
    __name__,
    {
        "._thresholds": (
            "EpisodeThresholds",
            "Thresholds",
        ),
    },
)
