"""Searches that can be killed, resumed and shared by processes: tuning and falsification."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

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

__getattr__ = lazy_page(__name__, __file__)
