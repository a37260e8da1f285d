"""What a tuning was asked for: written beside it, so that it is resumed as it was begun."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Final

from .._errors import SimError

_FILE: Final = "tune.json"
#: Held-out seeds begin so far after the tuning ones.
HELD_OUT_FROM: Final = 1_000_000
# What may differ when a tuning goes on: more trials, in other words.
_MAY_DIFFER: Final = ("trials",)


@dataclass(frozen=True, slots=True)
class TuneSettings:
    """What a tuning was asked for.

    Attributes:
        policy_name: what tables call the base policy.
        policy: YAML of the base policy.
        scenarios: YAML of the templates.
        ranges: where to search, by place in the policy.
        trials: policies to try.
        episodes: tuning seeds, each run in every scenario.
        held_out: held-out seeds, each run in every scenario.
        perception: ``"truth"``, ``"keypoints"`` or ``"pixels"``.
        planner: ``"module:Class"``, empty for the reference planner.
        seed: the first tuning seed, and of the sampler.
        sampler: ``"tpe"`` or ``"nsga2"``.
        generation: trials a generation.
    """

    policy_name: str
    policy: str
    scenarios: tuple[str, ...]
    ranges: dict[str, dict[str, Any]]
    trials: int
    episodes: int
    held_out: int
    perception: str
    planner: str
    seed: int
    sampler: str
    generation: int

    @property
    def tuning_seeds(self) -> range:
        """Seeds that trials are judged by."""
        return range(self.seed, self.seed + self.episodes)

    @property
    def held_out_seeds(self) -> range:
        """Seeds that no trial has met; disjoint from the tuning seeds."""
        first = self.seed + HELD_OUT_FROM
        return range(first, first + self.held_out)


def keep_settings(settings: TuneSettings, folder: Path, *, resume: bool) -> None:
    """Write the settings, or check that they are those of the tuning that is there.

    Raises:
        SimError: a tuning is there and ``resume`` is False, or it was asked for otherwise.
    """
    path = folder / _FILE
    if not path.exists():
        if resume and folder.exists():
            raise SimError(f"--resume: there is no tuning in {folder}, no {_FILE}")
        folder.mkdir(parents=True, exist_ok=True)
    elif not resume:
        raise SimError(
            f"{folder} already holds a tuning; give --resume to go on with it, or another --out"
        )
    else:
        _compare(path, settings)
    part = path.with_name(path.name + ".part")
    part.write_text(json.dumps(asdict(settings), indent=1) + "\n", encoding="utf-8")
    part.replace(path)


def _compare(path: Path, settings: TuneSettings) -> None:
    try:
        before = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as cause:
        raise SimError(f"cannot read {path}: {cause}") from cause
    now = json.loads(json.dumps(asdict(settings)))
    for field in fields(settings):
        if field.name not in _MAY_DIFFER and before.get(field.name) != now[field.name]:
            raise SimError(
                f"{path.parent} was begun with another {field.name}: "
                f"{_short(before.get(field.name))}, now {_short(now[field.name])}; give the same "
                "again, or another --out"
            )
    if before.get("trials", 0) > settings.trials:
        raise SimError(
            f"{path.parent} was asked for {before['trials']} trials; fewer cannot be had, got "
            f"--trials {settings.trials}"
        )


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
