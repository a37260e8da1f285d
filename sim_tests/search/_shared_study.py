"""A study on disk whose trials any number of processes evaluate together."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..world.errors import SimError
from ._optimizer import Optimizer, Outcome, ParameterValues
from ._optuna import DATABASE_ERRORS, event, optuna
from ._process_lock import ProcessLock

#: User attribute of a trial with the notes of its outcome.
NOTES = "notes"
_FAILED = "failed"


@dataclass(frozen=True, slots=True)
class Claim:
    """A trial that only this process evaluates, as long as it lives.

    Attributes:
        number: number of the trial.
        parameters: values of the parameters.
        lock: held until the outcome of the trial is told.
    """

    number: int
    parameters: ParameterValues
    lock: ProcessLock


class SharedStudy(AbstractContextManager["SharedStudy"]):
    """A study in Optuna's SQLite file, shared by any number of processes on one computer.

    A process claims free trials of the current generation. When all trials of a generation are
    finished, the next generation is proposed. A trial belongs to the process that holds its lock
    file. If that process is killed, its trial is free at once and keeps its number and parameters.
    One more lock guards every access to the file, because SQLite gives up when several processes
    write.

    Args:
        folder: holds ``study.db`` and the locks; made when missing.
        name: name of the study in the file.
        optimizer: a new optimizer, which is told the outcomes in the file.
        total: number of trials; may be larger when the study is resumed.

    Raises:
        SimError: a folder that cannot be written, or a file that holds another search.
    """

    def __init__(self, folder: Path, name: str, optimizer: Optimizer, total: int) -> None:
        self.name = name
        self._optimizer = optimizer
        self._total = total
        self._locks = folder / "locks"
        self._told = 0
        with self._locked():
            url = f"sqlite:///{folder / 'study.db'}"
            try:
                self._storage = optuna.storages.RDBStorage(url)
                event.listen(self._storage.engine, "connect", _write_ahead)
                self._storage.engine.dispose()  # new connections use _write_ahead
                self._study = optuna.create_study(
                    storage=self._storage,
                    study_name=name,
                    directions=["minimize"] * optimizer.objectives,
                    sampler=optuna.samplers.RandomSampler(seed=0),  # never used
                    load_if_exists=True,
                )
            except Exception as cause:  # SQLAlchemy and Optuna raise many types
                raise SimError(f"cannot use {folder / 'study.db'} as a study: {cause}") from cause
            self._catch_up()

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._storage.remove_session()
        self._storage.engine.dispose()

    @property
    def study(self) -> optuna.Study:
        """The study in the file, for reading."""
        return self._study

    @property
    def finished_count(self) -> int:
        """Number of finished trials."""
        with self._locked():
            return len(self._finished())

    @property
    def is_complete(self) -> bool:
        """True if all trials are finished."""
        return self.finished_count >= self._total

    def finished_trials(self) -> list[optuna.trial.FrozenTrial]:
        """Return the finished trials, by number."""
        with self._locked():
            return self._finished()

    def evaluate(
        self, most: int, outcomes_of: Callable[[Sequence[Claim]], Sequence[Outcome]]
    ) -> int:
        """Claim up to ``most`` trials, evaluate them and tell their outcomes.

        Args:
            most: number of trials to claim at most.
            outcomes_of: evaluates trials.

        Returns:
            The number of trials; 0 while other processes evaluate the rest of the generation.
        """
        claims = self.claim(most)
        for claim, outcome in zip(claims, outcomes_of(claims), strict=True):
            self.tell(claim, outcome)
        return len(claims)

    def claim(self, most: int) -> tuple[Claim, ...]:
        """Claim up to ``most`` trials; none while other processes evaluate the rest.

        Raises:
            SimError: the file holds another search.
        """
        with self._locked():
            trials = self._catch_up()
            wanted = min(self._optimizer.generation, self._total - self._told)
            if wanted <= 0:
                return ()
            proposals = self._optimizer.ask()[:wanted]
            for parameters in proposals[max(len(trials) - self._told, 0) :]:
                self._study.add_trial(
                    optuna.trial.create_trial(
                        state=optuna.trial.TrialState.WAITING,
                        params=parameters,
                        distributions=self._optimizer.distributions,
                    )
                )
            claims: list[Claim] = []
            for trial in self._study.get_trials(deepcopy=False)[self._told :][:wanted]:
                if len(claims) < most and not trial.state.is_finished():
                    claim = self._claim_trial(trial)
                    if claim is not None:
                        claims.append(claim)
            return tuple(claims)

    def tell(self, claim: Claim, outcome: Outcome) -> None:
        """Write the outcome of a trial and release it.

        Raises:
            SimError: values that are not finite.
        """
        values = outcome.values
        if values is not None and not all(math.isfinite(value) for value in values):
            raise SimError(f"trial {claim.number}: values must be finite, got {values}")
        with self._locked():
            number = claim.number
            trial_id = self._storage.get_trial_id_from_study_id_trial_number(
                self._study._study_id, number
            )
            trial = optuna.trial.Trial(self._study, trial_id)
            known = trial.constraints
            for name, value in outcome.constraints.items():
                if name not in known:  # written by a process that was killed below
                    trial.set_constraint(name, value)
            if outcome.notes:
                trial.set_user_attr(NOTES, dict(outcome.notes))
            if values is None:
                trial.set_user_attr(_FAILED, True)
                self._study.tell(number, state=optuna.trial.TrialState.FAIL)
            else:
                self._study.tell(number, list(values))
            claim.lock.close()
            self._lock_path(number).unlink(missing_ok=True)

    @contextmanager
    def _locked(self) -> Iterator[None]:
        """Hold the lock of the file; a file that cannot be read or written is a SimError."""
        with ProcessLock(self._locks / "study.lock"):
            try:
                yield
            except DATABASE_ERRORS as cause:
                reason = str(cause.__cause__ or cause).splitlines()[0]
                raise SimError(
                    f"cannot use {self._locks.parent / 'study.db'}: {reason}; the trials so far "
                    "are kept, and --resume continues"
                ) from cause

    def _lock_path(self, number: int) -> Path:
        return self._locks / f"{self.name.replace('/', '-')}-{number:06d}.lock"

    def _claim_trial(self, trial: optuna.trial.FrozenTrial) -> Claim | None:
        """Return the claim of a trial; None if another process holds it."""
        lock = ProcessLock(self._lock_path(trial.number), wait=False)
        if not lock.held:
            return None
        if trial.state == optuna.trial.TrialState.WAITING:
            # Optuna returns the first waiting trial, which is this one.
            number = self._study.ask().number
            if number != trial.number:
                lock.close()
                raise SimError(f"study {self.name}: trial {trial.number} is waiting, got {number}")
        return Claim(trial.number, dict(trial.params), lock)

    def _finished(self) -> list[optuna.trial.FrozenTrial]:
        trials = self._study.get_trials(deepcopy=False)
        return [trial for trial in trials[: self._total] if trial.state.is_finished()]

    def _catch_up(self) -> list[optuna.trial.FrozenTrial]:
        """Tell the optimizer every finished generation it has not been told; return all trials."""
        trials = self._study.get_trials(deepcopy=False)
        size = self._optimizer.generation
        while True:
            part = trials[self._told : self._told + size]
            if part:
                self._compare(part)
            if len(part) < size or not all(trial.state.is_finished() for trial in part):
                return trials
            self._optimizer.tell([_outcome(trial) for trial in part])
            self._told += size

    def _compare(self, trials: list[optuna.trial.FrozenTrial]) -> None:
        """Raise SimError if the optimizer proposes other trials than those in the file."""
        for trial, proposed in zip(trials, self._optimizer.ask(), strict=False):
            if not _same(trial.params, proposed):
                raise SimError(
                    f"study {self.name!r} was made by another search, or by another version of "
                    f"Optuna: trial {trial.number} has {trial.params}, this search proposes "
                    f"{proposed}; choose another folder"
                )


def _write_ahead(connection: Any, record: object) -> None:
    """Let SQLite wait for the disk at checkpoints only.

    A kill loses nothing, and a power cut does not damage the file.
    """
    connection.execute("PRAGMA journal_mode=WAL")
    connection.execute("PRAGMA synchronous=NORMAL")


def _same(first: ParameterValues, second: ParameterValues) -> bool:
    return first.keys() == second.keys() and all(
        math.isclose(first[name], second[name], rel_tol=1e-9, abs_tol=1e-12) for name in first
    )


def _outcome(trial: optuna.trial.FrozenTrial) -> Outcome:
    values = None if _FAILED in trial.user_attrs else tuple(trial.values)
    return Outcome(values, trial.constraints)
