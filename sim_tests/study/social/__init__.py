"""Measures that others use, and episodes in the formats that others read."""

from __future__ import annotations

from ._episode import SocialEpisode
from ._files import read_track, write_episode
from ._measures import SOCIAL_MEASURES, social_measures
from ._runs import export_episode, measure_sources
