"""Findings of the doctor, and their order."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, Literal, get_args

Severity = Literal["error", "warning", "fine"]
#: Subjects, the most important first: what makes results wrong, then what makes them poor.
Subject = Literal[
    "packages",
    "shipped networks",
    "networks",
    "odometry",
    "brakes",
    "scanners",
    "images",
    "mount",
    "calibration",
    "frame rate",
    "exposure",
    "sharpness",
    "resolution",
    "people",
    "recording",
    "fetched networks",
    "extras",
]
_SUBJECTS: Final[tuple[str, ...]] = get_args(Subject)
_SEVERITIES: Final = ("error", "warning", "fine")
_WIDTH: Final = 100
_INDENT: Final = 27


@dataclass(frozen=True, slots=True)
class Finding:
    """One finding.

    Attributes:
        severity: ``"error"``: results cannot be trusted or do not come; ``"warning"``: they are
            worse than need be; ``"fine"``.
        subject: what it is about.
        text: what was found.
        remedy: what mends it; empty if nothing is wrong.
    """

    severity: Severity
    subject: Subject
    text: str
    remedy: str = ""

    @classmethod
    def error(cls, subject: Subject, text: str, remedy: str = "") -> Finding:
        """Return an error."""
        return cls("error", subject, text, remedy)

    @classmethod
    def warning(cls, subject: Subject, text: str, remedy: str = "") -> Finding:
        """Return a warning."""
        return cls("warning", subject, text, remedy)

    @classmethod
    def fine(cls, subject: Subject, text: str) -> Finding:
        """Return that nothing is wrong."""
        return cls("fine", subject, text)


def by_importance(findings: Iterable[Finding]) -> list[Finding]:
    """Return errors before warnings before the rest, each in the order of the subjects."""
    return sorted(
        findings, key=lambda each: (_SEVERITIES.index(each.severity), _SUBJECTS.index(each.subject))
    )


def findings_text(findings: Iterable[Finding]) -> str:
    """Return the findings as lines, each with its remedy below."""
    lines = []
    for each in findings:
        word = "OK" if each.severity == "fine" else each.severity.upper()
        head = f"{word:9s}{each.subject:18s}"
        lines.append(_filled(each.text, head))
        if each.remedy:
            lines.append(_filled(f"→ {each.remedy}", " " * _INDENT))
    return "\n".join(lines)


def _filled(text: str, head: str) -> str:
    return textwrap.fill(
        text,
        _WIDTH,
        initial_indent=head,
        subsequent_indent=" " * _INDENT,
        break_on_hyphens=False,
        break_long_words=False,
    )
