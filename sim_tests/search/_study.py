"""A search in whole generations by a sampler of Optuna."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import Any, Literal

from pydantic import model_validator

from perception.installation import install_command

from ..world.config import SimConfig
from ..world.errors import SimError

try:
    import cmaes  # noqa: F401 - the sampler imports it only when it samples
    import optuna
    from optuna.trial import TrialState, create_trial
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise SimError(
        "tuning and falsification need optuna and cmaes, of which one is not installed; both are "
        f"part of the extra 'bench': {install_command('bench')}"
    ) from cause

optuna.logging.set_verbosity(optuna.logging.WARNING)

SamplerName = Literal["tpe", "nsga2", "cmaes"]
#: Values of parameters by name.
ParameterValues = dict[str, float]


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


#: Returns the outcomes of trials, given their parameters by number.
Evaluate = Callable[[Mapping[int, ParameterValues]], Sequence[Outcome]]


class Optimizer:
    """An ask-and-tell optimizer whose proposals depend only on its arguments and on the outcomes.

    Optuna's samplers use every trial that is finished when they are asked, so that their proposals
    depend on the order in which processes finish. This class shows a sampler whole generations
    only: it asks for all trials of a generation before it tells any of them, and tells all of them
    in order before it asks for the next. A search is therefore resumed by running it again with
    the episodes that have run already.

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

    def generations(self, evaluate: Evaluate, total: int | None = None) -> Iterator[list[Trial]]:
        """Yield one evaluated generation after another; the last one ends at ``total`` trials.

        Raises:
            SimError: a value that is not finite.
        """
        for first in count(0, self.generation):
            left = self.generation if total is None else max(total - first, 0)
            proposed = self.ask()[:left]
            if not proposed:
                return
            outcomes = evaluate(dict(enumerate(proposed, start=first)))
            rows = zip(proposed, outcomes, strict=True)
            trials = [Trial(first + row, *each) for row, each in enumerate(rows)]
            for each in trials:
                value = each.outcome.value
                if value is not None and not math.isfinite(value):
                    raise SimError(f"trial {each.number}: the value must be finite, got {value}")
            yield trials
            if len(proposed) == self.generation:
                self.tell([each.outcome for each in trials])


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


def _distributions(space: Mapping[str, Range]) -> dict[str, optuna.distributions.BaseDistribution]:
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
