"""A tuning: the search for policies that lose the least time at a given risk."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final, cast

from awarenav.errors import counted
from nav_adapter import AwarenessPolicy

from ...conditions import Perception
from ...crossing import named_policy
from ...scenario import Scenario
from ...study.frontier import TODAY, sensors_of_today
from ...study.measures import Interval
from ...study.runs import Job, plan_jobs, policy_of
from ...world.errors import SimError
from .._settings import EpisodeRunner, SearchSettings, search_folder
from .._study import Optimizer, Outcome, ParameterValues, SamplerName, Trial
from ._evaluation import (
    BEATS_BASE,
    OBJECTIVE,
    PLACES,
    RISK,
    Candidate,
    Dropped,
    Evaluation,
    dropped,
    level_of,
    merged,
    named_winner,
    stages,
)
from ._policy_space import PolicyRange, PolicySpace

_SETTINGS_FILE: Final = "tune.json"
_RESULTS: Final = ("trials.csv", "importances.json", "chosen.json", "chosen/*.yaml", "tuning.png")
# Distance from the first tuning seed to the first held-out seed.
_HELD_OUT_OFFSET: Final = 1_000_000
# Evaluated beside the trials.
_PRESETS: Final = ("blind", "conservative", "balanced", "assertive", TODAY)
# Without a number of their own, policies may have this share of the risk of today's AMR.
_SHARE_OF_TODAY: Final = 1.0 / 20.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TuneSettings(SearchSettings):
    """The settings of a tuning; ``episodes`` counts tuning seeds, of which ``seed`` is the first.

    Attributes:
        ranges: search ranges, by dotted key of the policy file.
        trials: number of policies to try.
        held_out: number of held-out seeds, each run in every scenario.
        sampler: ``"tpe"`` or ``"nsga2"``.
        hold_out_scenarios: names of the scenarios that no trial runs.
        risk: step-out impacts per 1 000 crossings that a policy may have; None for a twentieth of
            those of today's AMR in the same episodes.
        requests: requests for attention that a policy may make per crossing; None for no bound.
    """

    ranges: dict[str, dict[str, Any]]
    trials: int
    held_out: int
    sampler: str
    hold_out_scenarios: tuple[str, ...] = ()
    risk: float | None = None
    requests: float | None = None

    @property
    def tuning_scenarios(self) -> tuple[Scenario, ...]:
        """Scenarios by which trials are judged."""
        return tuple(
            each for each in self.all_scenarios if each.name not in self.hold_out_scenarios
        )

    @property
    def tuning_seeds(self) -> range:
        """Seeds by which trials are judged."""
        return range(self.seed, self.seed + self.episodes)

    @property
    def held_out_seeds(self) -> range:
        """Seeds that no trial has run; disjoint from the tuning seeds."""
        first = self.seed + _HELD_OUT_OFFSET
        return range(first, first + self.held_out)

    def risk_beside(self, today: Evaluation) -> float:
        """Return the impacts that a policy may have: the given ones, or a share of today's."""
        return _SHARE_OF_TODAY * today.risk if self.risk is None else self.risk

    def jobs(
        self,
        name: str,
        policy: AwarenessPolicy,
        seeds: Sequence[int],
        scenarios: Sequence[Scenario],
    ) -> tuple[Job, ...]:
        """Return the episodes of a policy: every seed in every one of some scenarios.

        Today's AMR has its laser scanners alone, where the robot has any.
        """
        perception = Perception.named(self.perception)
        sensors = perception.sensors
        return plan_jobs(
            scenarios,
            [(name, policy)],
            seeds,
            planners=[self.planner],
            # Without a camera of that kind it does not matter.
            perception=perception.kind if "camera" in sensors.split("+") else "keypoints",
            sensors=[sensors_of_today(sensors) if name == TODAY else sensors],
        )


def held_out_scenarios(scenarios: Sequence[Scenario]) -> tuple[str, ...]:
    """Return the names of the scenarios that no trial runs: every third, the second of three first.

    They are in the order of what people look at (attentive, mixed, unaware) and of the names. Of
    fewer than three scenarios none is held out.
    """
    names = [each.name for each in sorted(scenarios, key=lambda each: (each.attention, each.name))]
    return tuple(names[1::3]) if len(names) >= 3 else ()


@dataclass(frozen=True, slots=True, eq=False)
class Tuning:
    """The result of a tuning.

    Attributes:
        settings: its settings.
        ranges: of the parameters of the trials.
        trials: all finished trials, by number.
        ranked: trials within the constraints that ran every episode, by time lost.
        anchors: the base policy, the presets and today's AMR.
        chosen: the first of ``ranked``; none equals one of ``anchors``.
        risk: step-out impacts per 1 000 crossings that a policy may have on the tuning seeds.
        held_out_risk: the same on the held-out seeds.
    """

    settings: TuneSettings
    ranges: Mapping[str, PolicyRange]
    trials: tuple[Trial, ...]
    ranked: tuple[Trial, ...]
    anchors: tuple[Candidate, ...]
    chosen: tuple[Candidate, ...]
    risk: float
    held_out_risk: float

    @property
    def base(self) -> Candidate:
        """The base policy."""
        return self.anchors[0]

    @property
    def winner(self) -> Candidate | None:
        """The chosen policy that is shown to be better than the base policy, if there is one."""
        return next((each for each in self.chosen if each.name == BEATS_BASE), None)

    @property
    def asks(self) -> bool:
        """True if requests for attention are bounded, or a policy of the result made any."""
        rows = (*self.anchors, *self.chosen)
        made = any(each.tuning.requests or each.held_out.requests for each in rows)
        return made or self.settings.requests is not None

    def allows(self, candidate: Candidate) -> bool:
        """Return whether risk and requests of a policy on held-out are at most the given ones."""
        return candidate.held_out.is_within(self.held_out_risk, self.settings.requests)

    def minus_base(self, candidate: Candidate) -> Interval:
        """Return the paired difference in time lost to the base policy on the held-out episodes.

        Its level is that of the decision: all chosen policies together have 95 %.
        """
        level = level_of(len(self.chosen))
        return candidate.held_out.minus(self.base.held_out, OBJECTIVE, level)


def ranked_trials(trials: Sequence[Trial]) -> list[Trial]:
    """Return the trials that satisfy every constraint, by time lost.

    A trial that was dropped before it ran every episode is not among them.
    """
    feasible = [
        (trial.outcome.value, trial.number, trial)
        for trial in trials
        if trial.outcome.value is not None
        and all(value <= 0.0 for value in trial.outcome.constraints.values())
        and not trial.outcome.notes.get("dropped")
    ]
    return [trial for _, _, trial in sorted(feasible, key=lambda each: each[:2])]


def tune(
    settings: TuneSettings,
    folder: Path,
    *,
    workers: int,
    resume: bool,
    overwrite: bool = False,
    report: Callable[[Tuning], None] = lambda tuning: None,
) -> Tuning:
    """Search until all trials are finished.

    The folder is made when missing. The result does not depend on the number of workers. It is
    given to ``report`` while the folder is held.

    Raises:
        SimError: settings that do not fit together, another process that works in the folder, a
            preset with an episode without a result, or no trial with one.
    """
    base = policy_of(settings.policy)
    ranges = {key: PolicyRange.model_validate(each) for key, each in settings.ranges.items()}
    space = PolicySpace(base, ranges)
    optimizer = Optimizer(
        cast(SamplerName, settings.sampler),
        space.ranges,
        generation=settings.generation,
        seed=settings.seed,
        first=space.base_parameters(),
    )
    # Refuses what cannot be run.
    settings.jobs(settings.policy_name, base, settings.tuning_seeds, settings.all_scenarios)
    anchors = _anchors(settings.policy_name, base)
    held = search_folder(
        settings,
        folder / _SETTINGS_FILE,
        "tuning",
        resume=resume,
        overwrite=overwrite,
        results=_RESULTS,
        may_grow=["trials", "held_out"],
    )
    with held:
        with EpisodeRunner(folder, workers, "tune") as runner:
            race = _Race(settings, runner, space, anchors)
            runner.bar.total = race.planned_episodes
            race.run_anchors()
            generations = optimizer.generations(race.outcomes, settings.trials)
            done = [trial for each in generations for trial in each]
            runner.bar.set_postfix_str("held-out seeds")
            tuning = race.result(done)
            runner.bar.total = runner.bar.n  # some trials were dropped
        report(tuning)
    return tuning


def _anchors(policy_name: str, base: AwarenessPolicy) -> dict[str, AwarenessPolicy]:
    """Return the base policy and the presets by name; refuse a base with the name of a preset."""
    anchors = {policy_name: base}
    for name in _PRESETS:
        _, preset = named_policy(name)
        if name in anchors and anchors[name] != preset:
            raise SimError(f"a policy of your own needs a name of its own, got {name!r}")
        anchors[name] = preset
    return anchors


@dataclass(frozen=True, slots=True)
class _Race:
    """Runs trials, each only as long as it does not lose to the base policy, and the finalists."""

    settings: TuneSettings
    runner: EpisodeRunner
    space: PolicySpace
    anchors: dict[str, AwarenessPolicy]
    tuned: dict[str, Evaluation] = field(default_factory=dict)

    @property
    def planned_episodes(self) -> int:
        """The number of episodes at most."""
        settings, anchors = self.settings, len(self.anchors)
        per_trial = settings.episodes * len(settings.tuning_scenarios)
        per_held_out = settings.held_out * len(settings.scenarios)
        return per_trial * (settings.trials + anchors) + per_held_out * (anchors + len(PLACES))

    def run_anchors(self) -> None:
        """Evaluate the base policy and the presets on the tuning seeds."""
        self.runner.bar.set_postfix_str("presets")
        for name, policy in self.anchors.items():
            self.tuned[name] = self._tuned(name, policy)

    def outcomes(self, trials: Mapping[int, ParameterValues]) -> list[Outcome]:
        """Return the outcomes of trials, given their parameters by number."""
        return [self._outcome(number, values) for number, values in trials.items()]

    def result(self, trials: Sequence[Trial]) -> Tuning:
        """Return the result of a finished study; runs the held-out seeds."""
        if all(trial.outcome.value is None for trial in trials):
            error = trials[0].outcome.notes["error"]
            raise SimError(f"no trial could be judged; the first said: {error}")
        settings, ranked = self.settings, ranked_trials(trials)
        places = zip(PLACES, ranked, strict=False)
        rows = merged(
            [
                *(self._anchor(name) for name in self.anchors),
                *(self._finalist(trial, (name,)) for name, trial in places),
            ]
        )
        anchors = tuple(each for each in rows if each.trial is None)
        today = next(each for each in anchors if TODAY in each.names)
        held_out_risk = settings.risk_beside(today.held_out)
        new = [each for each in rows if each.trial is not None]
        elsewhere = settings.hold_out_scenarios
        chosen = named_winner(new, anchors[0], held_out_risk, elsewhere, settings.requests)
        return Tuning(
            settings=settings,
            ranges=self.space.ranges,
            trials=tuple(trials),
            ranked=tuple(ranked),
            anchors=anchors,
            chosen=tuple(chosen),
            risk=self._risk,
            held_out_risk=held_out_risk,
        )

    @property
    def _risk(self) -> float:
        return self.settings.risk_beside(self.tuned[TODAY])

    def _name_of(self, policy: AwarenessPolicy) -> str:
        """Return the name of the base policy or the preset that a policy is; empty for none."""
        return next((name for name, known in self.anchors.items() if known == policy), "")

    def _anchor(self, name: str) -> Candidate:
        policy = self.anchors[name]
        return Candidate((name,), None, policy, self.tuned[name], self._held_out(name, policy))

    def _finalist(self, trial: Trial, names: tuple[str, ...]) -> Candidate:
        """Return a trial as a candidate; as the anchor whose policy it has, if there is one."""
        policy, label = self.space.policy(trial.parameters), _label(trial.number)
        if anchor := self._name_of(policy):
            return replace(self._anchor(anchor), names=names)
        tuned, held_out = self._tuned(label, policy), self._held_out(label, policy)
        return Candidate(names, trial.number, policy, tuned, held_out)

    def _outcome(self, number: int, parameters: ParameterValues) -> Outcome:
        settings, base = self.settings, self.tuned[self.settings.policy_name]
        self.runner.bar.set_postfix_str(f"{number} of {counted(settings.trials, 'trial')}")
        policy = self.space.policy(parameters)
        evaluation = Evaluation(())
        reason: Dropped = ""
        if anchor := self._name_of(policy):  # the first trial is the base policy
            evaluation = self.tuned[anchor]
        else:
            for seeds in stages(settings.tuning_seeds):
                part = self._evaluate(_label(number), policy, seeds, settings.tuning_scenarios)
                if part.errors:
                    # Episodes without a result must not make a policy look better.
                    return Outcome(None, notes={"error": part.errors[0]})
                evaluation = Evaluation.joined([evaluation, part])
                if len(evaluation.records) == len(base.records):
                    break
                reason = dropped(evaluation, base, self._risk)
                if reason:
                    break
        time_s, risk = evaluation.estimate(base)
        contacts, requests = evaluation.moving_contacts, evaluation.requests
        constraints = {"moving_contacts": float(contacts), "over_risk": risk - self._risk}
        if settings.requests is not None:
            constraints["over_requests"] = requests - settings.requests
        notes = {
            RISK: risk,
            "moving_contacts": contacts,
            "requests": requests,
            "reached": evaluation.reached,
            "episodes": len(evaluation.records),
            "dropped": reason,
        }
        return Outcome(time_s, constraints, notes)

    def _tuned(self, name: str, policy: AwarenessPolicy) -> Evaluation:
        settings = self.settings
        return self._evaluate_all(name, policy, settings.tuning_seeds, settings.tuning_scenarios)

    def _held_out(self, name: str, policy: AwarenessPolicy) -> Evaluation:
        settings = self.settings
        return self._evaluate_all(name, policy, settings.held_out_seeds, settings.all_scenarios)

    def _evaluate_all(
        self,
        name: str,
        policy: AwarenessPolicy,
        seeds: range,
        scenarios: Sequence[Scenario],
    ) -> Evaluation:
        """Return the evaluation of a policy of which every episode has a result, or refuse it."""
        parts = [self._evaluate(name, policy, part, scenarios) for part in stages(seeds)]
        evaluation = Evaluation.joined(parts)
        if evaluation.errors:
            raise SimError(
                f"{counted(len(evaluation.errors), 'episode')} of {name} without a result; the "
                f"first: {evaluation.errors[0]}"
            )
        return evaluation

    def _evaluate(
        self,
        name: str,
        policy: AwarenessPolicy,
        seeds: range,
        scenarios: Sequence[Scenario],
    ) -> Evaluation:
        jobs = self.settings.jobs(name, policy, seeds, scenarios)
        texts = (json.dumps(asdict(job), sort_keys=True) for job in jobs)
        keys = [hashlib.sha256(text.encode()).hexdigest() for text in texts]
        return Evaluation.of(self.runner.run(keys, jobs.__getitem__))


def _label(number: int) -> str:
    return f"trial_{number:04d}"
