"""The file ``conduct.jsonl``: the conduct of the planner in each episode, a line as each ends.

Times differ from run to run, so they do not stand in ``episodes.csv``, which can be repeated.
"""

from __future__ import annotations

import json
from contextlib import AbstractContextManager
from dataclasses import asdict
from pathlib import Path
from typing import Final

from awarenav.files import write_text
from awarenav.line_files import LineFile
from perception.documents import parse_json

from ...world.errors import SimError
from ..measures import Conduct
from ..runs import Attempt

_NAME: Final = "conduct.jsonl"
_EPISODE: Final = "episode"


class ConductFile(AbstractContextManager["ConductFile"]):
    """The file in the folder of a comparison, written while its episodes run.

    Args:
        folder: of the comparison.
        resume: keep the lines that are there; without it they are replaced by the first new one.
    """

    def __init__(self, folder: Path, *, resume: bool) -> None:
        self._folder = folder
        self._resume = resume
        self._file: LineFile | None = None

    def __exit__(self, *_: object) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None

    def add(self, number: int, attempt: Attempt) -> None:
        """Write the conduct of an episode by the number of its job; nothing for a failed one."""
        if self._file is None:
            # Whole lines alone, so that a new one never joins an unfinished one.
            kept = read_conducts(self._folder) if self._resume else {}
            path = self._folder / _NAME
            write_text(path, "".join(_line(key, each) for key, each in kept.items()), SimError)
            self._file = LineFile(path, SimError)
        if attempt.conduct is not None:
            self._file.add(_line(number, attempt.conduct))


def read_conducts(folder: Path) -> dict[int, Conduct]:
    """Return the conducts in a folder by the number of their episode.

    Lines that cannot be read are left out: what they held is then not known.
    """
    path = folder / _NAME
    found: dict[int, Conduct] = {}
    if not path.is_file():
        return found
    for line in path.read_bytes().splitlines(keepends=True):
        try:
            content = parse_json(line.decode(), _NAME, SimError) if line.endswith(b"\n") else {}
            number = content.pop(_EPISODE)
            found[int(number)] = Conduct(**content)
        except (ValueError, TypeError, KeyError, AttributeError):
            continue
    return found


def _line(number: int, conduct: Conduct) -> str:
    return json.dumps({_EPISODE: number, **asdict(conduct)}) + "\n"
