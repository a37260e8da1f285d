"""The formats of exported episodes: written by name, read and checked by the end of the file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final, NamedTuple

from awarenav.errors import not_one_of

from ...world.errors import SimError
from ._episode import SocialEpisode
from ._mcap_file import check_mcap, read_mcap, write_mcap
from ._navwareset import check_navwareset, read_navwareset, write_navwareset
from ._socnav3 import check_socnav3, read_socnav3, write_socnav3


class EpisodeFormat(NamedTuple):
    """A format of episodes.

    Attributes:
        suffix: end of its files.
        write: function of a path and an episode.
        read: function of a path.
        check: function of a path that returns what is wrong.
    """

    suffix: str
    write: Callable[[Path, SocialEpisode], None]
    read: Callable[[Path], SocialEpisode]
    check: Callable[[Path], list[str]]


#: The formats by their names.
FORMATS: Final = {
    "socnav3": EpisodeFormat(".json", write_socnav3, read_socnav3, check_socnav3),
    "navwareset": EpisodeFormat(".csv", write_navwareset, read_navwareset, check_navwareset),
    "mcap": EpisodeFormat(".mcap", write_mcap, read_mcap, check_mcap),
}


def format_of(path: Path) -> str:
    """Return the name of the format that a file has by the end of its name.

    Raises:
        SimError: no format has this end.
    """
    for name, each in FORMATS.items():
        if path.suffix.lower() == each.suffix:
            return name
    ends = ", ".join(f"{each.suffix} ({name})" for name, each in FORMATS.items())
    raise SimError(f"an episode is a file that ends in {ends}, got {path}")


def write_episode(path: Path, episode: SocialEpisode, format: str = "") -> None:
    """Write an episode.

    Args:
        path: of the file.
        episode: to write.
        format: a name of :data:`FORMATS`; empty for the one of the file's end.

    Raises:
        SimError: an unknown format, or the file cannot be written.
        NavError: the package mcap is missing.
    """
    name = format or format_of(path)
    if name not in FORMATS:
        raise SimError(not_one_of("format", name, FORMATS))
    FORMATS[name].write(path, episode)


def read_episode(path: Path) -> SocialEpisode:
    """Return the episode in a file of any of the formats.

    Raises:
        SimError: an unknown format, or a file that does not follow it.
        NavError: for MCAP, the file cannot be read, or the package mcap is missing.
    """
    return FORMATS[format_of(path)].read(path)


def check_episode(path: Path) -> list[str]:
    """Return what is wrong with a file, one sentence for each field; empty if nothing is.

    Raises:
        SimError: an unknown format, or a file that cannot be read.
        NavError: for MCAP, the file cannot be read, or the package mcap is missing.
    """
    return FORMATS[format_of(path)].check(path)
