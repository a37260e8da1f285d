"""What a trial came to.

The interval in which a parameter is searched.

A search that proposes trials in generations and is told what they came to.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from pydantic import Field, model_validator

from tracking.config import StrictConfig

from ..world.errors import SimError
from ._optuna import optuna


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a trial came to.

    Attributes:
        values: the objectives, smaller is better; None for a trial that could not be judged.
        constraints: by name; kept where at most 0.
        notes: figures to keep beside the trial, plain JSON values.
    """

    values: tuple[float, ...] | None
    constraints: Mapping[str, float] = field(default_factory=dict)
    notes: Mapping[str, object] = field(default_factory=dict)


class Range(StrictConfig):
    """The interval in which a parameter is searched.

    Attributes:
        low: smallest value.
        high: largest value, above ``low``.
        log: search in the logarithm.
    """

    error: ClassVar[type[ValueError]] = SimError

    low: float
    high: float
    log: bool = Field(default=False)

    @model_validator(mode="after")
    def _ordered(self) -> Range:
        if self.high <= self.low:
            raise ValueError(f"high must exceed low, got {self.low:g} to {self.high:g}")
        if self.log and self.low <= 0.0:
            raise ValueError(f"low must be above 0 for log: true, got {self.low:g}")
        return self

    def clipped(self, value: float) -> float:
        """The value, or the nearer end."""
        return min(max(value, self.low), self.high)


Method = Literal["tpe", "nsga2", "cmaes"]
Parameters = dict[str, float]


class Search:
    """Proposes trials in generations: a pure function of its arguments and of what it was told.

    Optuna's samplers look at every trial that is finished when they are asked, so that what they
    propose depends on who was faster. Here a sampler sees whole generations only: all trials of one
    are proposed before any of them is told, and all are told, in order, before the next. Any number
    of processes that go through the same outcomes therefore propose the same trials, and a search
    is resumed by going through them again.

    Args:
        method: ``"tpe"`` (Watanabe 2023, several objectives, multivariate), ``"nsga2"`` (Deb et
            al. 2002), or ``"cmaes"`` (Hansen 2016, one objective; the first generation is random).
        space: where to search.
        generation: trials a generation, at least 2.
        seed: of the sampler.
        objectives: how many.
        first: parameters of the first trials, clipped to the space; at most a generation of them.
        start: where CMA-ES starts; default the middle.
        spread: CMA-ES's first standard deviation, as a share of each range.

    Raises:
        SimError: for numbers that do not go together.
    """

    def __init__(
        self,
        method: Method,
        space: Mapping[str, Range],
        *,
        generation: int,
        seed: int,
        objectives: int = 1,
        first: Sequence[Mapping[str, float]] = (),
        start: Mapping[str, float] | None = None,
        spread: float = 0.2,
    ) -> None:
        if not space:
            raise SimError("nothing to search: there is no parameter with a range")
        if generation < 2 or len(first) > generation:
            raise SimError(
                "a generation must hold at least 2 trials and all that are given, got "
                f"{generation} and {len(first)} given"
            )
        if method == "cmaes" and objectives != 1:
            raise SimError(f"cmaes searches for one objective, got {objectives}")
        self._method = method
        self.space = dict(space)
        self.generation = generation
        self.objectives = objectives
        self._distributions: dict[str, optuna.distributions.BaseDistribution] = {
            name: optuna.distributions.FloatDistribution(each.low, each.high, log=each.log)
            for name, each in self.space.items()
        }
        clipped = None if start is None else self._clipped(start)
        self._study = optuna.create_study(
            directions=["minimize"] * objectives,
            sampler=_sampler(method, generation, seed, clipped, spread),
        )
        for parameters in first:
            self._study.enqueue_trial(self._clipped(parameters))
        self._asked: list[optuna.trial.Trial] = []
        self._proposed: tuple[Parameters, ...] = ()

    @property
    def distributions(self) -> dict[str, optuna.distributions.BaseDistribution]:
        """The space in Optuna's terms."""
        return dict(self._distributions)

    def propose(self) -> tuple[Parameters, ...]:
        """The trials of this generation; the same until they have been told."""
        if not self._asked:
            with warnings.catch_warnings():
                # Experimental arguments, and what a sampler does before it knows anything.
                warnings.simplefilter("ignore")
                self._asked = [self._study.ask(self._distributions) for _ in range(self.generation)]
            self._proposed = tuple(dict(trial.params) for trial in self._asked)
        return self._proposed

    def tell(self, outcomes: Sequence[Outcome]) -> None:
        """What the trials of this generation came to, in order.

        Raises:
            SimError: for another number of outcomes than of trials, and for constraints, which
                CMA-ES knows nothing of.
        """
        if self._method == "cmaes" and any(outcome.constraints for outcome in outcomes):
            raise SimError("cmaes knows no constraints; put them into the objective")
        trials, self._asked = self._asked, []
        if len(outcomes) != len(trials):
            raise SimError(f"{len(trials)} trials were proposed, got {len(outcomes)} outcomes")
        for trial, outcome in zip(trials, outcomes, strict=True):
            for name, value in outcome.constraints.items():
                trial.set_constraint(name, value)
            if outcome.values is None:
                self._study.tell(trial, state=optuna.trial.TrialState.FAIL)
            else:
                self._study.tell(trial, list(outcome.values))

    def _clipped(self, parameters: Mapping[str, float]) -> Parameters:
        unknown = sorted(set(parameters) ^ set(self.space))
        if unknown:
            raise SimError(f"parameters must be those of the space; differing: {unknown}")
        return {name: each.clipped(parameters[name]) for name, each in self.space.items()}


def _sampler(
    method: Method, generation: int, seed: int, start: Parameters | None, spread: float
) -> optuna.samplers.BaseSampler:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of arguments that Optuna calls experimental
        if method == "tpe":
            return optuna.samplers.TPESampler(
                seed=seed, multivariate=True, n_startup_trials=max(generation, 10)
            )
        if method == "nsga2":
            return optuna.samplers.NSGAIISampler(seed=seed, population_size=generation)
        return optuna.samplers.CmaEsSampler(
            seed=seed,
            popsize=generation,
            n_startup_trials=1,
            x0=None if start is None else dict(start),
            sigma0=spread,
            independent_sampler=optuna.samplers.RandomSampler(seed=seed),
            warn_independent_sampling=False,
        )
