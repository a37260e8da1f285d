"""The file ``conduct.jsonl``: the conduct of the planner in each episode, a line as each ends.

Times differ from run to run, so they do not stand in ``episodes.csv``, which can be repeated.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Final

from ..measures import Conduct
from ..runs import Attempt

_NAME: Final = "conduct.jsonl"
_EPISODE: Final = "episode"


class ConductFile:
    """The file in the folder of a comparison, written while its episodes run.

    Args:
        folder: of the comparison.
        resume: keep the lines that are there; without it the first new one replaces them.
    """

    def __init__(self, folder: Path, *, resume: bool) -> None:
        self._path = folder / _NAME
        self._keeps = resume

    def add(self, number: int, attempt: Attempt) -> None:
        """Write the conduct of an episode by the number of its job; nothing for a failed one."""
        line = ""
        if attempt.conduct is not None:
            # Begins with a line end, so that it never joins an unfinished line.
            line = "\n" + json.dumps({_EPISODE: number, **asdict(attempt.conduct)})
        with self._path.open("a" if self._keeps else "w", encoding="utf-8") as file:
            file.write(line)
        self._keeps = True


def read_conducts(folder: Path) -> dict[int, Conduct]:
    """Return the conducts in a folder by the number of their episode.

    Lines that cannot be read are left out: what they held is then not known.
    """
    found: dict[int, Conduct] = {}
    path = folder / _NAME
    for line in path.read_bytes().splitlines() if path.is_file() else ():
        try:
            content = json.loads(line)
            number = int(content.pop(_EPISODE))
            found[number] = Conduct(**content)
        except (ValueError, TypeError, KeyError, AttributeError):
            continue
    return found
