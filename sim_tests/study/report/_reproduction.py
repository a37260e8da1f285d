"""Section of a report: the configuration of the run, from which it can be repeated."""

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
        command: the command line; empty when not known.
        facts: names and values of everything else in ``run.json``.
        scenarios: each as ``name@version``.
        seeds: the seeds as ranges.
        policies: names and YAML texts.
        faults: names and YAML texts.
    """

    command: str
    facts: tuple[tuple[str, str], ...]
    scenarios: tuple[str, ...]
    seeds: str
    policies: tuple[tuple[str, str], ...]
    faults: tuple[tuple[str, str], ...]


def reproduction(run: RunData) -> Reproduction:
    """Return the configuration of a run."""
    facts = dict(run.about)
    command = facts.pop("command", "")
    if isinstance(command, list):
        command = " ".join(map(str, command))
    records = [each.record for each in run.episodes]
    return Reproduction(
        str(command),
        tuple(_flat(facts)),
        tuple(sorted({f"{each.scenario}@{each.scenario_version}" for each in records})),
        _ranges(each.seed for each in records),
        _distinct((job.policy_name, job.policy) for job in run.jobs),
        _distinct((job.fault_name, job.fault) for job in run.jobs if job.fault_name),
    )


def _ranges(numbers: Iterable[int]) -> str:
    """Return whole numbers as ranges: ``0–4, 7``."""
    parts = []
    for _, pairs in itertools.groupby(
        enumerate(sorted(set(numbers))), key=lambda pair: pair[1] - pair[0]
    ):
        values = [value for _, value in pairs]
        parts.append(f"{values[0]}–{values[-1]}" if len(values) > 1 else str(values[0]))
    return ", ".join(parts)


def title_of(run: RunData, policies: int) -> str:
    """Return the title of a report: the numbers of crossings, scenarios, policies and seeds."""
    records = [each.record for each in run.episodes]
    scenarios = len({(each.scenario, each.scenario_version) for each in records})
    return (
        f"{plural(len(records), 'crossing')}: {plural(scenarios, 'scenario')}, "
        f"{plural(policies, 'policy', 'policies')}, "
        f"{plural(len({each.seed for each in records}), 'seed')}"
    )


def _flat(content: Any, prefix: str = "") -> list[tuple[str, str]]:
    """Return nested mappings with dotted names, and a list as one line."""
    if isinstance(content, dict):
        return [
            pair
            for key, value in content.items()
            for pair in _flat(value, f"{prefix}.{key}" if prefix else str(key))
        ]
    if isinstance(content, list):
        content = ", ".join(map(str, content))
    return [(prefix, "–" if content is None else str(content))]


def _distinct(pairs: Iterable[tuple[str, str]]) -> tuple[tuple[str, str], ...]:
    """Return each pair of a name and its text once, in order."""
    return tuple(dict.fromkeys(pairs))
