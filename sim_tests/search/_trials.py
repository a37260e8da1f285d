"""A trial that this process works on.

The study on disk: which trials there are, who works on them, and what they came to.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from awarenav.closing import Closing

from ..world.errors import SimError
from ._file_lock import FileLock
from ._optuna import event, optuna
from ._search import Outcome, Parameters, Search


@dataclass(frozen=True, slots=True)
class Ticket:
    """A trial that this process works on, and nobody else while it lives.

    Attributes:
        number: of the trial.
        parameters: by name.
        lock: held until the trial is told.
    """

    number: int
    parameters: Parameters
    lock: FileLock


_FAILED = "failed"
#: User attribute of a trial: the notes of its outcome.
NOTES = "notes"


class TrialBook(Closing):
    """A search's trials in Optuna's SQLite file, shared by any number of processes of one machine.

    Whoever comes next takes a trial of the current generation that nobody works on; when all are
    finished the next generation is proposed. A trial belongs to the process that holds its lock
    file, so that one left running by a kill is taken up again at once, under the same number and
    with the same parameters. All reading and writing happens under one more lock: SQLite alone
    would lose patience where several processes write.

    Args:
        folder: holds ``study.db`` and the locks; made when missing.
        name: of the study in the file.
        search: freshly made; told here of what the file knows.
        total: trials to run; may be raised later.

    Raises:
        SimError: for a folder that cannot be written, or a file that holds another search.
    """

    def __init__(self, folder: Path, name: str, search: Search, total: int) -> None:
        self.name = name
        self._search = search
        self._total = total
        self._locks = folder / "locks"
        self._told = 0
        with self._locked():
            url = f"sqlite:///{folder / 'study.db'}"
            try:
                self._storage = optuna.storages.RDBStorage(url)
                event.listen(self._storage.engine, "connect", _write_ahead)
                self._storage.engine.dispose()  # connections from here on are set up so
                self._study = optuna.create_study(
                    storage=self._storage,
                    study_name=name,
                    directions=["minimize"] * search.objectives,
                    sampler=optuna.samplers.RandomSampler(seed=0),  # is never asked
                    load_if_exists=True,
                )
            except Exception as cause:  # SQLAlchemy's and Optuna's, of many kinds
                raise SimError(f"cannot use {folder / 'study.db'} as a study: {cause}") from cause
            self._catch_up()

    def close(self) -> None:
        """Leave the file to others."""
        self._storage.remove_session()
        self._storage.engine.dispose()

    @property
    def study(self) -> optuna.Study:
        """The study in the file, to read."""
        return self._study

    @property
    def finished(self) -> int:
        """How many of the trials asked for are finished."""
        with self._locked():
            return len(self._finished())

    @property
    def done(self) -> bool:
        """Whether all trials are finished."""
        return self.finished >= self._total

    def finished_trials(self) -> list[optuna.trial.FrozenTrial]:
        """Those that are, by number."""
        with self._locked():
            return self._finished()

    def claim(self, most: int) -> tuple[Ticket, ...]:
        """Take up to so many trials; none when others work on what is left for now.

        Raises:
            SimError: when the file holds another search than this one.
        """
        with self._locked():
            trials = self._catch_up()
            wanted = min(self._search.generation, self._total - self._told)
            if wanted <= 0:
                return ()
            proposals = self._search.propose()[:wanted]
            for parameters in proposals[max(len(trials) - self._told, 0) :]:
                self._study.add_trial(
                    optuna.trial.create_trial(
                        state=optuna.trial.TrialState.WAITING,
                        params=parameters,
                        distributions=self._search.distributions,
                    )
                )
            tickets: list[Ticket] = []
            for trial in self._study.get_trials(deepcopy=False)[self._told :][:wanted]:
                if len(tickets) < most and not trial.state.is_finished():
                    ticket = self._taken(trial)
                    if ticket is not None:
                        tickets.append(ticket)
            return tuple(tickets)

    def tell(self, ticket: Ticket, outcome: Outcome) -> None:
        """Write down what a trial came to, and let go of it.

        Raises:
            SimError: for values that are not finite.
        """
        values = outcome.values
        if values is not None and not all(math.isfinite(value) for value in values):
            raise SimError(f"trial {ticket.number}: values must be finite, got {values}")
        with self._locked():
            number = ticket.number
            trial_id = self._storage.get_trial_id_from_study_id_trial_number(
                self._study._study_id, number
            )
            trial = optuna.trial.Trial(self._study, trial_id)
            known = trial.constraints
            for name, value in outcome.constraints.items():
                if name not in known:  # a kill came between this and the end
                    trial.set_constraint(name, value)
            if outcome.notes:
                trial.set_user_attr(NOTES, dict(outcome.notes))
            if values is None:
                trial.set_user_attr(_FAILED, True)
                self._study.tell(number, state=optuna.trial.TrialState.FAIL)
            else:
                self._study.tell(number, list(values))
            ticket.lock.close()
            self._lock_path(number).unlink(missing_ok=True)

    def _locked(self) -> FileLock:
        return FileLock(self._locks / "study.lock")

    def _lock_path(self, number: int) -> Path:
        return self._locks / f"{self.name.replace('/', '-')}-{number:06d}.lock"

    def _taken(self, trial: optuna.trial.FrozenTrial) -> Ticket | None:
        lock = FileLock(self._lock_path(trial.number), wait=False)
        if not lock.held:
            return None
        if trial.state == optuna.trial.TrialState.WAITING:
            # Gives out the first that waits: the one before it runs or is finished.
            number = self._study.ask().number
            if number != trial.number:
                lock.close()
                raise SimError(f"study {self.name}: trial {trial.number} is waiting, got {number}")
        return Ticket(trial.number, dict(trial.params), lock)

    def _finished(self) -> list[optuna.trial.FrozenTrial]:
        trials = self._study.get_trials(deepcopy=False)
        return [trial for trial in trials[: self._total] if trial.state.is_finished()]

    def _catch_up(self) -> list[optuna.trial.FrozenTrial]:
        """Tell the search every whole generation that it has not heard of; all trials there are."""
        trials = self._study.get_trials(deepcopy=False)
        size = self._search.generation
        while True:
            part = trials[self._told : self._told + size]
            if part:
                self._compare(part)
            if len(part) < size or not all(trial.state.is_finished() for trial in part):
                return trials
            self._search.tell([_outcome(trial) for trial in part])
            self._told += size

    def _compare(self, trials: list[optuna.trial.FrozenTrial]) -> None:
        for trial, proposed in zip(trials, self._search.propose(), strict=False):
            if not _same(trial.params, proposed):
                raise SimError(
                    f"study {self.name!r} was made by another search, or by another version of "
                    f"Optuna: trial {trial.number} has {trial.params}, this search proposes "
                    f"{proposed}; choose another folder"
                )


def _write_ahead(connection: Any, record: object) -> None:
    """Wait for the disk at checkpoints only: a kill loses nothing, a power cut no whole file."""
    connection.execute("PRAGMA journal_mode=WAL")
    connection.execute("PRAGMA synchronous=NORMAL")


def _same(first: Parameters, second: Parameters) -> bool:
    return first.keys() == second.keys() and all(
        math.isclose(first[name], second[name], rel_tol=1e-9, abs_tol=1e-12) for name in first
    )


def _outcome(trial: optuna.trial.FrozenTrial) -> Outcome:
    values = None if _FAILED in trial.user_attrs else tuple(trial.values)
    return Outcome(values, trial.constraints)
