"""Searches that can be killed, resumed and shared by processes: tuning and falsification."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._episode_runner import EpisodeRunner
    from ._files import write_or_check_settings
    from ._optimizer import Optimizer, Outcome, ParameterValues, Range
    from ._process_lock import ProcessLock
    from ._shared_study import Claim, SharedStudy

__all__ = [
    "Claim",
    "EpisodeRunner",
    "Optimizer",
    "Outcome",
    "ParameterValues",
    "ProcessLock",
    "Range",
    "SharedStudy",
    "write_or_check_settings",
]

__getattr__ = lazy_names(
    __name__,
    {
        "._episode_runner": ("EpisodeRunner",),
        "._files": ("write_or_check_settings",),
        "._optimizer": (
            "Optimizer",
            "Outcome",
            "ParameterValues",
            "Range",
        ),
        "._process_lock": ("ProcessLock",),
        "._shared_study": (
            "Claim",
            "SharedStudy",
        ),
    },
)
