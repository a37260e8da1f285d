"""A search in whole generations, kept in Optuna's journal, on which several processes may work."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import model_validator

from perception.installation import install_command

from ..world.config import SimConfig
from ..world.errors import SimError

try:
    import cmaes  # noqa: F401 - the sampler imports it only when it samples
    import optuna
    from optuna.storages import JournalStorage
    from optuna.storages.journal import JournalFileBackend, JournalFileOpenLock
    from optuna.trial import FrozenTrial, TrialState, create_trial
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise SimError(
        "tuning and falsification need optuna and cmaes, of which one is not installed; both are "
        f"part of the extra 'bench': {install_command('bench')}"
    ) from cause

optuna.logging.set_verbosity(optuna.logging.WARNING)

SamplerName = Literal["tpe", "nsga2", "cmaes"]
#: Values of parameters by name.
ParameterValues = dict[str, float]

# The lock of the journal of a process that was killed while it wrote is broken after this time.
_LOCK_S: Final = 10
# User attributes of a trial in the journal.
_NUMBER: Final = "number"
_FIGURES: Final = "figures"
# Both are in the figures.
_CONSTRAINTS: Final = "constraints"
_NOTES: Final = "notes"


class Range(SimConfig):
    """The range in which a parameter is searched.

    Attributes:
        low: smallest value.
        high: largest value, above ``low``.
        log: search on a logarithmic scale.
    """

    low: float
    high: float
    log: bool = False

    @model_validator(mode="after")
    def _ordered(self) -> Range:
        if self.high <= self.low:
            raise ValueError(f"high must exceed low, got {self.low:g} to {self.high:g}")
        if self.log and self.low <= 0.0:
            raise ValueError(f"low must be above 0 for log: true, got {self.low:g}")
        return self

    def clipped(self, value: float) -> float:
        """Return the value, or the nearest end of the range."""
        return min(max(value, self.low), self.high)


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of a trial.

    Attributes:
        value: what is minimised; None for a trial without a result.
        constraints: constraints by name; one is satisfied where it is ≤ 0.
        notes: other figures of the trial, as plain JSON values.
    """

    value: float | None
    constraints: Mapping[str, float] = field(default_factory=dict)
    notes: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Trial:
    """A finished trial.

    Attributes:
        number: its place in the order of the proposals, from 0.
        parameters: values of the parameters.
        outcome: what its evaluation gave.
    """

    number: int
    parameters: ParameterValues
    outcome: Outcome


class Optimizer:
    """An ask-and-tell optimizer whose proposals depend only on its arguments and on the outcomes.

    Optuna's samplers use every trial that is finished when they are asked, so that their proposals
    depend on the order in which processes finish. This class shows a sampler whole generations
    only: it asks for all trials of a generation before it tells any of them, and tells all of them
    in order before it asks for the next. Processes that tell the same outcomes therefore propose
    the same trials, and a search is resumed by telling its outcomes again.

    Args:
        sampler: ``"tpe"`` (Watanabe 2023; multivariate), ``"nsga2"`` (Deb et al. 2002), or
            ``"cmaes"`` (Hansen 2016; without constraints, the first generation is random).
        space: range of each parameter.
        generation: trials per generation, at least 2.
        seed: seed of the sampler.
        first: values of the first trial, clipped to the space; also the initial mean of CMA-ES.
        spread: initial standard deviation of CMA-ES, as a share of each range.

    Raises:
        SimError: arguments that do not fit together.
    """

    def __init__(
        self,
        sampler: SamplerName,
        space: Mapping[str, Range],
        *,
        generation: int,
        seed: int,
        first: Mapping[str, float],
        spread: float = 0.2,
    ) -> None:
        if not space or space.keys() != first.keys():
            raise SimError(
                f"a search needs parameters, and a first value of each; got ranges of "
                f"{sorted(space)} and values of {sorted(first)}"
            )
        if generation < 2:
            raise SimError(f"a generation must hold at least 2 trials, got {generation}")
        self.generation = generation
        self.distributions = _distributions(space)
        start = {name: each.clipped(first[name]) for name, each in space.items()}
        self._study = optuna.create_study(
            sampler=_make_sampler(sampler, generation, seed, start, spread)
        )
        self._study.enqueue_trial(start)
        self._asked: list[optuna.trial.Trial] = []

    def ask(self) -> list[ParameterValues]:
        """Return the trials of this generation; the same until their outcomes are told."""
        if not self._asked:
            with warnings.catch_warnings():
                # Optuna warns of experimental arguments, and of random sampling at the start.
                warnings.simplefilter("ignore")
                self._asked = [self._study.ask(self.distributions) for _ in range(self.generation)]
        return [dict(trial.params) for trial in self._asked]

    def tell(self, outcomes: Sequence[Outcome]) -> None:
        """Tell the outcomes of this generation, in the order of its trials."""
        trials, self._asked = self._asked, []
        for trial, outcome in zip(trials, outcomes, strict=True):
            for name, value in outcome.constraints.items():
                trial.set_constraint(name, value)
            if outcome.value is None:
                self._study.tell(trial, state=TrialState.FAIL)
            else:
                self._study.tell(trial, outcome.value)


class SharedStudy:
    """A study in Optuna's journal, on which any number of processes may work.

    The journal holds the trials that were begun, and their outcomes. A process takes trials of the
    current generation: those that nobody has begun, then those that another one has begun. Since
    equal parameters have equal outcomes, the first outcome of a trial counts, and a process that
    dies or is slow holds nobody up. When a generation is finished, every process proposes the same
    next one.

    Args:
        path: the journal; it and its folder are made when missing.
        optimizer: a new optimizer, which is told the outcomes in the journal.
        total: number of trials; may be larger when the study is resumed.

    Raises:
        SimError: a journal that cannot be read or written, or that holds another search.
    """

    def __init__(self, path: Path, optimizer: Optimizer, total: int) -> None:
        self._path = path
        self._optimizer = optimizer
        self._total = total
        self._told = 0
        self._finished: dict[int, Trial] = {}
        self._begun: set[int] = set()
        with self._said():
            path.parent.mkdir(parents=True, exist_ok=True)
            lock = JournalFileOpenLock(str(path), grace_period=_LOCK_S)
            backend = JournalFileBackend(str(path), lock)
            _cut_torn_line(path, lock)
            self._storage = JournalStorage(backend)
            self._study_id = optuna.create_study(
                storage=self._storage, study_name=path.stem, load_if_exists=True
            )._study_id
            self._read()

    def trials(self) -> list[Trial]:
        """Return the finished trials of all processes, by number."""
        with self._said():
            self._read()
        return [trial for _, trial in sorted(self._finished.items()) if trial.number < self._total]

    def evaluate(
        self, most: int, outcomes_of: Callable[[Mapping[int, ParameterValues]], Sequence[Outcome]]
    ) -> None:
        """Evaluate trials of the current generation."""
        with self._said():
            self._read()
            proposals = dict(enumerate(self._optimizer.ask(), start=self._told))
            free = [n for n in proposals if n < self._total and n not in self._finished]
            free.sort(key=lambda number: number in self._begun)
            chosen = {number: proposals[number] for number in sorted(free[:most])}
            ids = [self._begin(number, parameters) for number, parameters in chosen.items()]
        outcomes = outcomes_of(chosen)
        with self._said():
            for number, trial_id, outcome in zip(chosen, ids, outcomes, strict=True):
                self._finish(number, trial_id, outcome)

    def _begin(self, number: int, parameters: ParameterValues) -> int:
        """Write that this process works on a trial; return its number in the journal."""
        trial = create_trial(
            state=TrialState.RUNNING,
            params=parameters,
            distributions=self._optimizer.distributions,
            user_attrs={_NUMBER: number},
        )
        return self._storage.create_new_trial(self._study_id, template_trial=trial)

    def _finish(self, number: int, trial_id: int, outcome: Outcome) -> None:
        value = outcome.value
        if value is not None and not math.isfinite(value):
            raise SimError(f"trial {number}: the value must be finite, got {value}")
        figures = {_CONSTRAINTS: dict(outcome.constraints), _NOTES: dict(outcome.notes)}
        self._storage.set_trial_user_attr(trial_id, _FIGURES, figures)
        if value is None:
            self._storage.set_trial_state_values(trial_id, TrialState.FAIL)
        else:
            self._storage.set_trial_state_values(trial_id, TrialState.COMPLETE, [value])

    def _read(self) -> None:
        """Read the journal; tell the optimizer every finished generation that it does not know."""
        for trial in self._storage.get_all_trials(self._study_id, deepcopy=False):
            number = trial.user_attrs[_NUMBER]
            self._begun.add(number)
            if trial.state.is_finished() and number not in self._finished:
                self._finished[number] = _finished_trial(trial)
        while True:
            generation = dict(enumerate(self._optimizer.ask(), start=self._told))
            for number, proposed in generation.items():
                if number in self._finished:
                    self._compare(self._finished[number], proposed)
            if not generation.keys() <= self._finished.keys():
                return
            self._optimizer.tell([self._finished[number].outcome for number in generation])
            self._told += len(generation)

    def _compare(self, trial: Trial, proposed: ParameterValues) -> None:
        """Raise SimError if the optimizer proposes another trial than that of the journal."""
        known = trial.parameters
        if known.keys() != proposed.keys() or not all(
            math.isclose(known[name], proposed[name], rel_tol=1e-9, abs_tol=1e-12) for name in known
        ):
            raise SimError(
                f"{self._path} was made by another search, or by another version of Optuna: trial "
                f"{trial.number} has {known}, this search proposes {proposed}; choose another "
                "folder"
            )

    @contextmanager
    def _said(self) -> Iterator[None]:
        """Turn the errors of the journal into SimError."""
        try:
            yield
        except SimError:
            raise
        except (OSError, ValueError, KeyError, optuna.exceptions.OptunaError) as cause:
            reason = getattr(cause, "strerror", None) or cause
            raise SimError(
                f"cannot use {self._path}: {reason}; the trials so far are kept, and --resume "
                "continues"
            ) from cause


def importances(
    points: Sequence[ParameterValues], values: Sequence[float], space: Mapping[str, Range]
) -> dict[str, float]:
    """Return the importance of each parameter for being among the best tenth; they sum to 1.

    By PED-ANOVA (Watanabe, Bansal and Hutter 2023). All are 0 for fewer than three trials, and
    where the values do not differ.
    """
    nothing = dict.fromkeys(sorted(space), 0.0)
    if len(points) < 3 or len(set(values)) < 2:
        return nothing
    study = optuna.create_study()
    for point, value in zip(points, values, strict=True):
        study.add_trial(
            create_trial(params=point, distributions=_distributions(space), value=value)
        )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Optuna warns of experimental arguments
        shares = optuna.importance.get_param_importances(
            study, evaluator=optuna.importance.PedAnovaImportanceEvaluator()
        )
    known = {name: share for name, share in shares.items() if math.isfinite(share)}
    return dict(sorted((nothing | known).items(), key=lambda each: -each[1]))


def _distributions(
    space: Mapping[str, Range],
) -> dict[str, optuna.distributions.BaseDistribution]:
    return {
        name: optuna.distributions.FloatDistribution(each.low, each.high, log=each.log)
        for name, each in space.items()
    }


def _make_sampler(
    name: SamplerName, generation: int, seed: int, start: ParameterValues, spread: float
) -> optuna.samplers.BaseSampler:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Optuna warns of experimental arguments
        if name == "tpe":
            return optuna.samplers.TPESampler(
                seed=seed, multivariate=True, n_startup_trials=max(generation, 10)
            )
        if name == "nsga2":
            return optuna.samplers.NSGAIISampler(seed=seed, population_size=generation)
        return optuna.samplers.CmaEsSampler(
            seed=seed,
            popsize=generation,
            n_startup_trials=1,
            x0=dict(start),
            sigma0=spread,
            independent_sampler=optuna.samplers.RandomSampler(seed=seed),
            warn_independent_sampling=False,
        )


def _cut_torn_line(path: Path, lock: JournalFileOpenLock) -> None:
    """Cut off a last line that a full disk or a killed process left unfinished."""
    lock.acquire()
    try:
        with path.open("rb+") as file:
            file.truncate(file.read().rfind(b"\n") + 1)
    finally:
        lock.release()


def _finished_trial(trial: FrozenTrial) -> Trial:
    value = trial.values[0] if trial.values else None
    figures = trial.user_attrs[_FIGURES]
    outcome = Outcome(value, figures[_CONSTRAINTS], figures[_NOTES])
    return Trial(trial.user_attrs[_NUMBER], dict(trial.params), outcome)
