"""What it takes to run the same again."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from ._run_data import RunData
from ._text import plural


@dataclass(frozen=True, slots=True)
class Reproduction:
    """The configuration of a run.

    Attributes:
        command: that started it, empty when not known.
        facts: name and value of everything else that ``run.json`` says.
        scenarios: ``name@version``.
        seeds: as ranges.
        policies: name and YAML.
        faults: name and YAML.
    """

    command: str
    facts: tuple[tuple[str, str], ...]
    scenarios: tuple[str, ...]
    seeds: str
    policies: tuple[tuple[str, str], ...]
    faults: tuple[tuple[str, str], ...]


def reproduction(folder: RunData) -> Reproduction:
    """Gather what a run's folder says about itself."""
    run = dict(folder.run)
    command = run.pop("command", "")
    if isinstance(command, list):
        command = " ".join(map(str, command))
    records = [each.record for each in folder.episodes]
    return Reproduction(
        str(command),
        tuple(_flat(run)),
        tuple(sorted({f"{each.scenario}@{each.scenario_version}" for each in records})),
        ranges(each.seed for each in records),
        _texts((job.policy_name, job.policy) for job in folder.jobs),
        _texts((job.fault_name, job.fault) for job in folder.jobs if job.fault_name),
    )


def ranges(numbers: Iterable[int]) -> str:
    """Whole numbers as ranges: ``0–4, 7``."""
    parts = []
    for _, run in itertools.groupby(
        enumerate(sorted(set(numbers))), key=lambda pair: pair[1] - pair[0]
    ):
        values = [value for _, value in run]
        parts.append(f"{values[0]}–{values[-1]}" if len(values) > 1 else str(values[0]))
    return ", ".join(parts)


def title_of(folder: RunData, policies: int) -> str:
    """What was run, in a few words."""
    records = [each.record for each in folder.episodes]
    scenarios = len({(each.scenario, each.scenario_version) for each in records})
    return (
        f"{plural(len(records), 'crossing')}: {plural(scenarios, 'scenario')}, "
        f"{plural(policies, 'policy', 'policies')}, "
        f"{plural(len({each.seed for each in records}), 'seed')}"
    )


def _flat(content: Any, prefix: str = "") -> list[tuple[str, str]]:
    """Nested mappings as dotted names; a list in one line."""
    if isinstance(content, dict):
        return [
            pair
            for key, value in content.items()
            for pair in _flat(value, f"{prefix}.{key}" if prefix else str(key))
        ]
    if isinstance(content, list):
        content = ", ".join(map(str, content))
    return [(prefix, "–" if content is None else str(content))]


def _texts(pairs: Iterable[tuple[str, str]]) -> tuple[tuple[str, str], ...]:
    """Every name with each of the texts that it stands for, in order."""
    return tuple(dict.fromkeys(pairs))
