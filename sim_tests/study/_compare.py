"""The command ``awarenav compare``: tables of one or more runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from awarenav.errors import not_one_of
from awarenav.files import json_text

from ..world.errors import SimError
from .measures import BASELINE, summarise_sources, summary_text, write_records
from .runs import answering_note, read_rows, read_run


def compare_command(
    runs: Sequence[Path], *, baseline: str, level: float, seed: int, out: Path | None, as_json: bool
) -> int:
    """Read runs, print their tables, and write their episodes to ``out``.

    Raises:
        SimError: a run cannot be read, the baseline is not among its policies, or an option is out
            of range.
    """
    names = _run_names(runs)
    if out is not None and out.suffix not in (".csv", ".parquet"):
        raise SimError(f"--out must be a .csv or .parquet file, got {out}")
    sources = {name: read_rows(path) for name, path in zip(names, runs, strict=True)}
    records = [record for table in sources.values() for record in table]
    if not records:
        raise SimError(f"no episodes yet in {', '.join(map(str, runs))}")
    _check_baseline(baseline, sorted({record.policy for record in records}))
    summary = summarise_sources(sources, baseline=baseline, level=level, seed=seed)
    if as_json:
        print(json_text(asdict(summary)).rstrip())
    else:
        asked = any(row.asked for row in summary.policies)
        answering = dict.fromkeys(answering_note(read_run(path)) for path in runs if asked)
        print(summary_text(summary, filter(None, answering)))
    if out is not None:
        write_records(out, records)
    return 0


def _run_names(runs: Sequence[Path]) -> list[str]:
    """Return a name for each run: the shortest end of its path that tells it from the others."""
    if len(runs) == 1:
        return [""]
    parts = [run.resolve().parts for run in runs]
    if len(set(parts)) < len(parts):
        raise SimError(f"give each run once, got {', '.join(map(str, runs))}")
    depth = next(
        depth
        for depth in range(1, max(map(len, parts)) + 1)
        if len({part[-depth:] for part in parts}) == len(parts)
    )
    return ["/".join(part[-depth:]) for part in parts]


def _check_baseline(baseline: str, policies: Sequence[str]) -> None:
    """Refuse a baseline that is not among the policies, except the default."""
    if baseline in policies or (baseline == BASELINE and len(policies) >= 1):
        return  # without the default baseline, nothing is compared
    raise SimError(not_one_of("--baseline", baseline, policies))
