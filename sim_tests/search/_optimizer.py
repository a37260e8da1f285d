"""An ask-and-tell optimizer that works in whole generations."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from pydantic import Field, model_validator

from ..world.config import SimConfig
from ..world.errors import SimError
from ._optuna import optuna

SamplerName = Literal["tpe", "nsga2", "cmaes"]
#: Values of parameters by name.
ParameterValues = dict[str, float]


@dataclass(frozen=True, slots=True)
class Outcome:
    """The result of a trial.

    Attributes:
        values: objectives, smaller is better; None for a trial without a result.
        constraints: constraints by name; one is satisfied where it is ≤ 0.
        notes: other figures of the trial, as plain JSON values.
    """

    values: tuple[float, ...] | None
    constraints: Mapping[str, float] = field(default_factory=dict)
    notes: Mapping[str, object] = field(default_factory=dict)


class Range(SimConfig):
    """The range in which a parameter is searched.

    Attributes:
        low: smallest value.
        high: largest value, above ``low``.
        log: search on a logarithmic scale.
    """

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
        """Return the value, or the nearest end of the range."""
        return min(max(value, self.low), self.high)


class Optimizer:
    """An ask-and-tell optimizer whose proposals depend only on its arguments and on the outcomes.

    Optuna's samplers use every trial that is finished when they are asked, so that their proposals
    depend on the order in which processes finish. This class shows a sampler whole generations
    only: it asks for all trials of a generation before it tells any of them, and tells all of them
    in order before it asks for the next. Processes that tell the same outcomes therefore propose
    the same trials, and a search is resumed by telling its outcomes again.

    Args:
        sampler: ``"tpe"`` (Watanabe 2023; several objectives, multivariate), ``"nsga2"`` (Deb et
            al. 2002), or ``"cmaes"`` (Hansen 2016; one objective, the first generation is random).
        space: range of each parameter.
        generation: trials per generation, at least 2.
        seed: seed of the sampler.
        objectives: number of objectives.
        initial: values of the first trials, clipped to the space; at most one generation.
        start: initial mean of CMA-ES; default the middle of the space.
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
        objectives: int = 1,
        initial: Sequence[Mapping[str, float]] = (),
        start: Mapping[str, float] | None = None,
        spread: float = 0.2,
    ) -> None:
        if not space:
            raise SimError("nothing to search: there is no parameter with a range")
        if generation < 2 or len(initial) > generation:
            raise SimError(
                "a generation must hold at least 2 trials and all initial ones, got a generation "
                f"of {generation} and {len(initial)} initial trials"
            )
        if sampler == "cmaes" and objectives != 1:
            raise SimError(f"cmaes searches for one objective, got {objectives}")
        self._sampler = sampler
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
            sampler=_make_sampler(sampler, generation, seed, clipped, spread),
        )
        for parameters in initial:
            self._study.enqueue_trial(self._clipped(parameters))
        self._asked: list[optuna.trial.Trial] = []
        self._proposals: tuple[ParameterValues, ...] = ()

    @property
    def distributions(self) -> dict[str, optuna.distributions.BaseDistribution]:
        """The space as Optuna's distributions."""
        return dict(self._distributions)

    def ask(self) -> tuple[ParameterValues, ...]:
        """Return the trials of this generation; the same until their outcomes are told."""
        if not self._asked:
            with warnings.catch_warnings():
                # Optuna warns of experimental arguments, and of random sampling at the start.
                warnings.simplefilter("ignore")
                self._asked = [self._study.ask(self._distributions) for _ in range(self.generation)]
            self._proposals = tuple(dict(trial.params) for trial in self._asked)
        return self._proposals

    def tell(self, outcomes: Sequence[Outcome]) -> None:
        """Tell the outcomes of this generation, in the order of its trials.

        Raises:
            SimError: another number of outcomes than of trials, or constraints with CMA-ES, which
                does not support them.
        """
        if self._sampler == "cmaes" and any(outcome.constraints for outcome in outcomes):
            raise SimError("cmaes supports no constraints; put them into the objective")
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

    def _clipped(self, parameters: Mapping[str, float]) -> ParameterValues:
        unknown = sorted(set(parameters) ^ set(self.space))
        if unknown:
            raise SimError(f"parameters must be those of the space; differing: {unknown}")
        return {name: each.clipped(parameters[name]) for name, each in self.space.items()}


def _make_sampler(
    name: SamplerName, generation: int, seed: int, start: ParameterValues | None, spread: float
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
            x0=None if start is None else dict(start),
            sigma0=spread,
            independent_sampler=optuna.samplers.RandomSampler(seed=seed),
            warn_independent_sampling=False,
        )
