"""Episodes that ended in an error, those with the same message together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from ._episode import Episode
from ._run_folder import RunFolder
from ._text import count

_EXAMPLES: Final = 5


@dataclass(frozen=True, slots=True)
class Failure:
    """One message, how often it came, in which scenarios, and how to see it again."""

    message: str
    times: str
    scenarios: tuple[str, ...]
    replays: tuple[str, ...]
    more: int


def failures(folder: RunFolder) -> tuple[Failure, ...]:
    """The messages, the most frequent first."""
    groups: dict[str, list[Episode]] = {}
    for each in folder.episodes:
        if each.record.error:
            groups.setdefault(each.record.error, []).append(each)
    ordered = sorted(groups.items(), key=lambda item: (-len(item[1]), item[0]))
    return tuple(_failure(folder, message, episodes) for message, episodes in ordered)


def _failure(folder: RunFolder, message: str, episodes: Sequence[Episode]) -> Failure:
    replays = [command for each in episodes if (command := folder.replay(each))]
    return Failure(
        message,
        count(len(episodes)),
        tuple(sorted({each.record.scenario for each in episodes})),
        tuple(replays[:_EXAMPLES]),
        max(len(replays) - _EXAMPLES, 0),
    )
