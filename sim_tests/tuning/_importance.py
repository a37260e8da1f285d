"""Which parameters decided how good a trial was."""

from __future__ import annotations

import math
import warnings

from ..search._optuna import optuna
from ._evaluation import OBJECTIVES


def importances(study: optuna.Study) -> dict[str, dict[str, float]]:
    """Share of each parameter in being among the best tenth, by objective; they sum to 1.

    PED-ANOVA (Watanabe, Bansal and Hutter 2023). All are 0 where the trials do not differ in the
    objective, or are fewer than three.
    """
    done = [t for t in study.get_trials(deepcopy=False) if t.values is not None]
    names = sorted({name for trial in done for name in trial.params})
    return {objective: _one(study, row, names, done) for row, objective in enumerate(OBJECTIVES)}


def _one(
    study: optuna.Study, row: int, names: list[str], done: list[optuna.trial.FrozenTrial]
) -> dict[str, float]:
    nothing = dict.fromkeys(names, 0.0)
    if len(done) < 3 or len({trial.values[row] for trial in done}) < 2:
        return nothing
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = optuna.importance.get_param_importances(
            study,
            evaluator=optuna.importance.PedAnovaImportanceEvaluator(),
            target=lambda trial: trial.values[row],
        )
    known = {name: value for name, value in found.items() if math.isfinite(value)}
    return dict(sorted((nothing | known).items(), key=lambda each: -each[1]))
