"""The work of ``awarenav judge``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..errors import AwarenavError
from ..files import json_text, write_text
from ._judge import JudgeConfig, judge_files
from ._report import markdown_report
from ._requirements import requirements


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgeOptions:
    """The options of ``awarenav judge``."""

    truth: Path
    estimates: Path
    out: Path | None
    as_json: bool
    min_height_px: float
    max_occlusion: float
    max_truncation: float
    common: bool
    gate: bool


def judge_command(options: JudgeOptions) -> int:
    """Run the command; return the exit status.

    Raises:
        AwarenavError: for files or options that cannot be used.
    """
    out = options.out
    if out is not None and out.suffix not in (".json", ".md"):
        raise AwarenavError(f"--out must end in .json or .md, got {out}")
    config = JudgeConfig.checked(
        min_height_px=options.min_height_px,
        max_occlusion=options.max_occlusion,
        max_truncation=options.max_truncation,
    )
    metrics = judge_files(options.truth, options.estimates, config, common=options.common)
    report = markdown_report(metrics)
    print(json_text(metrics) if options.as_json else report, end="")
    if out is not None:
        write_text(out, report if out.suffix == ".md" else json_text(metrics))
    met = all(each.met for each in requirements(metrics))
    return 1 if options.gate and not met else 0
