"""Measures that others use, and episodes in the formats that others read."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._episode import Outcome, SocialEpisode
    from ._files import FORMATS, read_track, write_episode
    from ._measures import SOCIAL_MEASURES, SocialMeasure, social_measures
    from ._recorder import EpisodeRecorder, episode_of

__all__ = [
    "FORMATS",
    "SOCIAL_MEASURES",
    "EpisodeRecorder",
    "Outcome",
    "SocialEpisode",
    "SocialMeasure",
    "episode_of",
    "read_track",
    "social_measures",
    "write_episode",
]

__getattr__ = lazy_page(__name__, __file__)
