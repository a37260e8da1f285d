"""The common part of both searches: folder, settings, episodes, results, the next command."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from tqdm import tqdm

from awarenav.files import write_text
from perception.documents import parse_json, read_json

from ..conditions import (
    REFERENCE_PLANNER,
    Experiment,
    Perception,
    option_words,
    refuse_unused_networks,
)
from ..crossing import named_policy
from ..scenario import Scenario
from ..study.measures import EpisodeRecord, nondeterminism_notes
from ..study.runs import Job, Workers, attempt, died, held, named_scenarios, policy_text
from ..world.bullet import require_pybullet
from ..world.errors import SimError

# The episodes of a search that have run, one a line: their keys and the columns of their rows.
_EPISODES: Final = "episodes.jsonl"
# Options that the next command has otherwise.
_OWN_WORDS: Final = ("policy", "seed", "episodes")


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchSettings:
    """The settings that tuning and falsification share, as plain values.

    Attributes:
        policy_name: name of the policy in tables.
        policy: YAML of the policy.
        scenarios: YAML of each.
        episodes: number of episodes; the search says of what.
        perception: as for :func:`sim_tests.run_crossing`, such as ``"keypoints+scanner"``.
        planner: ``"module:Class"``, empty for the reference planner.
        seed: seed of the episodes, and of the search.
        generation: trials per generation.
    """

    policy_name: str
    policy: str
    scenarios: tuple[str, ...]
    episodes: int
    perception: str
    planner: str
    seed: int
    generation: int

    @property
    def all_scenarios(self) -> tuple[Scenario, ...]:
        """All scenarios."""
        return tuple(Scenario.from_text(text) for text in self.scenarios)


def common_settings(experiment: Experiment) -> dict[str, Any]:
    """Return the settings of an experiment, but for the episodes and the generation."""
    name, own_policy = named_policy(experiment.one("policy"))
    refuse_unused_networks(experiment.changes, experiment["perception"])
    scenarios = named_scenarios(experiment["scenario"], **experiment.changes)
    return {
        "policy_name": name,
        "policy": policy_text(own_policy),
        "scenarios": tuple(each.to_text() for each in scenarios),
        "perception": Perception.of(experiment["perception"], experiment.one("sensors")).name,
        "planner": experiment.one("planner"),
        "seed": experiment["seed"],
    }


@contextmanager
def search_folder(settings: SearchSettings, path: Path, search: str, **how: Any) -> Iterator[None]:
    """Hold the folder of a search, whose settings are in ``path``, against other processes.

    ``how`` is as for :func:`write_or_check_settings`, which names the errors.
    """
    folder = path.parent
    require_pybullet()
    if how["resume"] and not path.exists():  # a refusal makes no folder
        raise SimError(f"--resume: there is no {search} in {folder}, no {path.name}")
    lock = held(folder)
    try:
        write_or_check_settings(settings, path, search, **how)
        yield
    finally:
        lock.release()


def write_or_check_settings(
    settings: SearchSettings,
    path: Path,
    search: str,
    *,
    resume: bool,
    overwrite: bool = False,
    results: Sequence[str] = (),
    may_grow: Sequence[str] = (),
) -> None:
    """Write the settings of a new search, or check that a resumed search has the same.

    Raises:
        SimError: the folder holds a search and neither ``resume`` nor ``overwrite`` is True, it
            holds results of something else, or the settings differ.
    """
    folder = path.parent
    text = json.dumps(asdict(settings), indent=1) + "\n"
    old = [each for pattern in (_EPISODES, *results) for each in sorted(folder.glob(pattern))]
    if path.exists() and resume:
        _compare(path, parse_json(text, path.name, SimError), may_grow)
    elif path.exists() and not overwrite:
        raise SimError(
            f"{folder} already holds a {search}; give --resume to continue it, --overwrite "
            "to replace it, or another --out"
        )
    elif old and not path.exists():
        raise SimError(
            f"{folder} holds {old[0].name} but no {path.name}, so it is not the folder of a "
            f"{search}; choose another --out"
        )
    try:  # the old settings go last, so that a kill leaves what can be removed
        for each in () if resume else (*old, path):
            each.unlink(missing_ok=True)
    except OSError as cause:
        raise SimError(f"cannot write {path}: {cause.strerror or cause}") from cause
    write_text(path, text, SimError)


def write_json(path: Path, data: Any) -> None:
    """Write a JSON file that appears whole or not at all."""
    write_text(path, json.dumps(data, indent=1, ensure_ascii=False) + "\n", SimError)


def print_results(
    file: Path, table: Sequence[str], verdict: str, next_command: str, *, as_json: bool
) -> None:
    """Print the file of the results, or a table, a verdict and the command to run next."""
    if as_json:
        print(file.read_text(encoding="utf-8"), end="")
        return
    print("\n".join(table))
    print(f"Verdict: {verdict}\nNext: {next_command}\nWritten to {file.parent}")


def episode_words(experiment: Experiment) -> list[str]:
    """Return the words of the command line that repeat scenarios, people, sensors and planner."""
    settings = experiment.settings()
    settings = {name: settings[name] for name in settings if name not in _OWN_WORDS}
    if settings.get("planner") == [REFERENCE_PLANNER]:
        del settings["planner"]
    return option_words(settings)


def command_text(*words: object) -> str:
    """Return a command that a shell reads as these words."""
    return shlex.join(["awarenav", *map(str, words)])


def _compare(path: Path, now: dict[str, Any], may_grow: Sequence[str]) -> None:
    """Raise SimError for the first setting that differs from the file."""
    before = read_json(path, SimError)
    if not isinstance(before, dict):
        raise SimError(f"{path} must hold settings by name, got {before!r:.60}")
    for name, value in now.items():
        was = before.get(name)
        if value == was or (name in may_grow and was is not None and value > was):
            continue
        more = " or more" if name in may_grow else ""
        raise SimError(
            f"{path.parent} was begun with another {name}: {_short(was)}, now {_short(value)}; "
            f"give the same{more} again, or another --out"
        )


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


class EpisodeRunner:
    """Runs batches of episodes, each once, also if the search is resumed.

    Args:
        folder: of the search.
        workers: number of processes; 1 runs everything in this process.
        label: label of the progress bar.
        total: number of episodes, if known.

    Attributes:
        bar: the progress bar on standard error, which counts episodes.

    Raises:
        SimError: the file of the episodes so far cannot be read.
    """

    def __init__(self, folder: Path, workers: int, label: str, total: int | None = None) -> None:
        self._path = folder / _EPISODES
        self._known = _read_episodes(self._path)
        self._workers = Workers(workers)
        self._unrepeatable: set[str] = set()
        self.bar = tqdm(desc=label, total=total, unit="episode", smoothing=0.05, file=sys.stderr)

    def __enter__(self) -> EpisodeRunner:
        return self

    def __exit__(self, *_: object) -> None:
        self._workers.__exit__()
        self.bar.close()

    def run(self, keys: Sequence[str], job: Callable[[int], Job]) -> tuple[EpisodeRecord, ...]:
        """Run episodes; ``error`` of a record says why one failed.

        A planner that is not deterministic is named once on standard error.

        Args:
            keys: what tells the episodes of the search apart.
            job: returns the episode of a place in ``keys``; asked for those that have not run.

        Raises:
            SimError: an episode cannot be written.
        """
        records = {n: self._known[key] for n, key in enumerate(keys) if key in self._known}
        self.bar.update(len(records))
        new = [number for number in range(len(keys)) if number not in records]
        for place, outcome in self._workers.results(attempt, map(job, new), on_death=died):
            records[new[place]] = outcome.record
            if not outcome.record.error:  # one that failed runs again
                self._keep(keys[new[place]], outcome.record)
            self.bar.update()
        differing = [each for each in records.values() if each.nondeterministic]
        unsaid = {record.planner for record in differing} - self._unrepeatable
        self._unrepeatable |= unsaid
        for note in nondeterminism_notes(each for each in differing if each.planner in unsaid):
            self.bar.write(note, file=sys.stderr)
        return tuple(records[number] for number in range(len(keys)))

    def _keep(self, key: str, record: EpisodeRecord) -> None:
        """Write an episode that has run."""
        self._known[key] = record
        cells = {name: value for name, value in asdict(record).items() if value not in (None, "")}
        try:
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"key": key, "record": cells}) + "\n")
        except OSError as cause:
            raise SimError(
                f"cannot write {self._path}: {cause.strerror or cause}; the episodes so far are "
                "kept, and --resume continues"
            ) from cause


def _read_episodes(path: Path) -> dict[str, EpisodeRecord]:
    """Return the episodes of a search that have run, by their keys.

    A last line that a full disk or a killed process left unfinished is cut off.
    """
    if not path.exists():
        return {}
    with path.open("rb+") as file:
        text = file.read()
        file.truncate(text.rfind(b"\n") + 1)
    found = {}
    for number, line in enumerate(text.split(b"\n")[:-1], start=1):
        try:
            data = parse_json(line, path.name, SimError)
            found[data["key"]] = EpisodeRecord(**data["record"])
        except (SimError, KeyError, TypeError) as cause:
            raise SimError(
                f"{path}, line {number} is no episode of a search: remove the line, and it runs "
                "again"
            ) from cause
    return found
