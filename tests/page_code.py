"""The code of a documentation page: its blocks in order, run as a reader would run them.

A block is fenced (```` ```sh ````, ```` ```python ````, ```` ```text ````, …) or, for commands,
indented by four spaces. A paragraph that ends in "save … as `NAME`:" makes the block after it a
file. A ``text`` block shows what the block before it prints. These comments before a block change
what a test does with it::

    <!-- not run: REASON -->      left out
    <!-- slow: REASON -->         run by `pytest --full` only
    <!-- exits with 2 -->         the exit status of the last command
    <!-- varies: REASON -->       the output shown is not compared
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import stat
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal

from paths import ROOT

Kind = Literal["shell", "python", "file", "output"]

_SHELLS = ("sh", "console", "bash")
_COMMANDS = ("awarenav ", "python ", "pytest ", "pip ", "make ", "cd ", "cp ", "git ")
_DIRECTIVE = re.compile(r"<!-- (not run|slow|varies|exits with)(?::? (.*?))? -->")
_SAVED = re.compile(r"\bsave\b[^.]*?\sas\s`([\w./-]+)`[^`]*:$", re.IGNORECASE | re.DOTALL)
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
_SECONDS = 600
# A figure may differ between computers by this share, or by two units of its last digit.
_TOLERANCE = 0.05


@dataclass(frozen=True)
class Block:
    """A block of code of a page, and what the comment before it says."""

    kind: Kind
    text: str
    line: int
    name: str = ""
    skipped: str = ""
    slow: bool = False
    status: int = 0
    varies: bool = False


def blocks_of(text: str) -> Iterator[Block]:
    """Yield the blocks of a page in Markdown that a reader runs, saves or compares."""
    lines = text.split("\n")
    number, paragraph = 0, ""
    directives: dict[str, str] = {}
    while number < len(lines):
        line = lines[number]
        fence = re.match(r"^```(\w*)", line)
        indented = line.startswith("    ") and not paragraph
        if fence or indented:
            end, last = number + 1, "```" if fence else ""
            while end < len(lines) and (
                not lines[end].startswith(last) if fence else lines[end].startswith("    ")
            ):
                end += 1
            body = lines[number + 1 : end] if fence else [each[4:] for each in lines[number:end]]
            code = "\n".join(body) + "\n"
            kind, name = _kind(fence[1] if fence else "", code, _before(lines, number))
            if kind is not None:
                yield _block(kind, code, number + 1, name, directives)
            directives = {}
            number, paragraph = end + 1 if fence else end, ""
            continue
        found = _DIRECTIVE.fullmatch(line.strip())
        if found:
            directives[found[1]] = found[2] or ""
        elif line.strip():
            directives = {}
        paragraph = line.strip() if not found else ""
        number += 1


def _before(lines: list[str], number: int) -> str:
    """Return the paragraph before a line, comments left out."""
    kept = [each for each in lines[:number] if not _DIRECTIVE.fullmatch(each.strip())]
    return "\n".join(kept).rstrip().rpartition("\n\n")[2]


def _kind(language: str, code: str, before: str) -> tuple[Kind | None, str]:
    saved = _SAVED.search(before)
    if saved:
        return "file", saved[1]
    if language in _SHELLS or (not language and code.startswith(_COMMANDS)):
        return "shell", ""
    return {"python": ("python", ""), "text": ("output", "")}.get(language, (None, ""))  # type: ignore[return-value]


def _block(kind: Kind, code: str, line: int, name: str, said: Mapping[str, str]) -> Block:
    return Block(
        kind,
        code,
        line,
        name,
        skipped=said.get("not run", ""),
        slow="slow" in said,
        status=int(said.get("exits with", "0")),
        varies="varies" in said,
    )


class Reader:
    """Somebody who follows a page in an empty folder.

    Args:
        page: the page, for messages.
        folder: the empty folder; the working directory must be the same.
        tools: a folder for the commands ``awarenav``, ``python`` and ``pytest``.
    """

    def __init__(self, page: str, folder: Path, tools: Path) -> None:
        self._page, self._folder = page, folder
        self._names: dict[str, Any] = {"__name__": "__page__"}
        self._printed: str | None = None
        searched = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
        self._environment = {
            **os.environ,
            "PATH": os.pathsep.join([str(tools), os.environ["PATH"]]),
            "PYTHONPATH": searched,
            "PYTHONWARNINGS": "error",
            "COLUMNS": "80",
        }
        commands = {"awarenav": "-m awarenav", "python": "", "pytest": "-m pytest"}
        for name, arguments in commands.items():
            path = tools / name
            path.write_text(f'#!/bin/sh\nexec "{sys.executable}" {arguments} "$@"\n')
            path.chmod(path.stat().st_mode | stat.S_IXUSR)

    def follow(self, blocks: list[Block], *, full: bool) -> int:
        """Do what the blocks say; return how many of them ran or were compared."""
        done = 0
        for block in blocks:
            if block.skipped or (block.slow and not full):
                self._printed = None
                continue
            where = f"{self._page}:{block.line}"
            if block.kind == "file":
                path = self._folder / block.name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(block.text, encoding="utf-8")
            elif block.kind == "shell":
                self._printed = self._shell(block, where)
            elif block.kind == "python":
                self._printed = self._python(block, where)
            elif self._printed is None:
                continue
            elif not block.varies:
                compare_output(block.text, self._printed, where)
            done += 1
        return done

    def _shell(self, block: Block, where: str) -> str:
        kept = [line for line in block.text.split("\n") if not is_installation(line, where)]
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", "\n".join(kept)],
            cwd=self._folder,
            env=self._environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            timeout=_SECONDS,
            check=False,
        )
        assert done.returncode == block.status, f"{where}:\n{done.stdout}"
        return done.stdout

    def _python(self, block: Block, where: str) -> str:
        printed = io.StringIO()
        # Line numbers in a traceback are those of the page.
        code = compile("\n" * block.line + block.text, where, "exec")
        with contextlib.redirect_stdout(printed):
            exec(code, self._names)
        return printed.getvalue()


@cache
def _extras() -> frozenset[str]:
    text = (ROOT / "pyproject.toml").read_text("utf-8")
    table = text.partition("[project.optional-dependencies]\n")[2].partition("\n[")[0]
    return frozenset(re.findall(r"^([\w-]+) = \[", table, re.MULTILINE))


def is_installation(line: str, where: str) -> bool:
    """Say whether a line installs awarenav; its extras must exist. It is not run: see packaging."""
    if not line.startswith("pip install "):
        return False
    for words in re.findall(r"\[([\w,]+)\]", line):
        for extra in words.split(","):
            assert extra in _extras(), f"{where}: {line}: no extra {extra!r}"
    return True


def compare_output(shown: str, printed: str, where: str) -> None:
    """Check that the lines shown were printed, in this order.

    ``…`` stands for anything, also for lines that are left out. Figures may differ as computers do.
    """
    rest = re.split(r"[\r\n]+", printed)
    for line in shown.split("\n"):
        if not line.strip() or line.strip() == "…":
            continue
        while rest and not _same(line, rest[0]):
            rest.pop(0)
        assert rest, (
            f"{where}: not printed, or not in this order: {line!r}; printed was:\n{printed}"
        )


def _same(shown: str, printed: str) -> bool:
    pattern, figures = "", []
    for part in re.split(r"(-?\d+(?:\.\d+)?|…|\s+)", shown.strip()):
        if _NUMBER.fullmatch(part):
            pattern += r"(-?\d+(?:\.\d+)?)"
            figures.append(part)
        elif part == "…":
            pattern += ".*?"
        elif part and not part.strip():
            pattern += r"\s+"
        else:
            pattern += re.escape(part)
    found = re.fullmatch(pattern, printed.strip())
    return found is not None and all(
        _near(*pair) for pair in zip(figures, found.groups(), strict=True)
    )


def _near(shown: str, printed: str) -> bool:
    unit = 10.0 ** -len(shown.partition(".")[2])
    if "." not in shown:
        unit = 0.0
    wanted = float(shown)
    return abs(float(printed) - wanted) <= max(2.0 * unit, _TOLERANCE * abs(wanted)) + 1e-12
