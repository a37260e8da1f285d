"""Whether asking pays: ``python -m benchmarks.asking``.

The same crossings are driven without requests and with them, for several shares of people who
answer. Each true look after a request is also compared with what the adapter made of it.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from nav_adapter import AwarenessPolicy
from nav_adapter.policies import AttentionRules
from perception.arrays import FloatArray
from sim_tests.crossing import CrossingFrame, CrossingResult, named_policy
from sim_tests.study.measures import EpisodeRecord
from sim_tests.study.runs import job_of, named_scenarios, observed_episode, policy_text

#: A look that is measured later than this came too late for its request.
SOON_S: Final = 1.0
#: The lower bound of α from which a look counts as measured.
LOOKED: Final = 0.5
#: A look within this time after a request answers it.
ANSWERED_WITHIN_S: Final = 2.5
#: Whoever has looked within this time before it was not won by it.
LOOKED_BEFORE_S: Final = 0.5
#: Somebody is at the obstacle's place within this distance.
SAME_PLACE_M: Final = 1.0


@dataclass(frozen=True, slots=True)
class AskedPerson:
    """The outcome of one request.

    Attributes:
        look_s: time from the request to the true look; None without one.
        measured_s: time from the look, or from the request without one, to the first update whose
            lower bound of α counts as a look; None if there was none within 3.5 s of the request.
        counted_s: time for which it counted without a break.
    """

    look_s: float | None
    measured_s: float | None
    counted_s: float = 0.0


def asked_people(result: CrossingResult) -> list[AskedPerson]:
    """Return what came of every request whose person is known, and had not looked before."""
    frames = result.frames
    times_s = np.array([frame.t_s for frame in frames])
    found = []
    for frame in frames:
        for alert in frame.constraints.alerts:
            if alert.kind != "attention":
                continue
            place = _place_of(frame, alert.track_id)
            person = None if place is None else _person_at(frame, place)
            if person is not None:
                asked = _asked(frames, times_s - frame.t_s, person)
                if asked is not None:
                    found.append(asked)
    return found


def _asked(
    frames: tuple[CrossingFrame, ...], since_s: FloatArray, person: int
) -> AskedPerson | None:
    looks = np.array([frame.truth[person].since_look_s <= 0.0 for frame in frames])
    lowers = np.array([_lower_of(frame, person) for frame in frames])
    if looks[(since_s >= -LOOKED_BEFORE_S) & (since_s <= 0.0)].any():
        return None
    after = np.flatnonzero(looks & (since_s > 0.0) & (since_s <= ANSWERED_WITHIN_S))
    begin_s = float(since_s[after[0]]) if len(after) else 0.0
    # Somebody who looks later than an answer may be measured then, and rightly so.
    until_s = ANSWERED_WITHIN_S + 1.0 if len(after) else ANSWERED_WITHIN_S
    counted = (lowers >= LOOKED) & (since_s >= begin_s - 1e-9) & (since_s <= until_s)
    look_s = begin_s if len(after) else None
    if not counted.any():
        return AskedPerson(look_s, None)
    first = int(np.argmax(counted))
    ends = np.flatnonzero((lowers < LOOKED) & (since_s > since_s[first]))
    end_s = since_s[ends[0]] if len(ends) else since_s[-1]
    return AskedPerson(look_s, float(since_s[first]) - begin_s, float(end_s - since_s[first]))


def _place_of(frame: CrossingFrame, track_id: int) -> FloatArray | None:
    for obstacle in frame.constraints.obstacles:
        if obstacle.track_id == track_id:
            return obstacle.center_odom_m
    return None


def _person_at(frame: CrossingFrame, place_m: FloatArray) -> int | None:
    if not frame.truth:
        return None
    away_m = [float(np.hypot(*(view.position_odom_m - place_m))) for view in frame.truth]
    nearest = int(np.argmin(away_m))
    return nearest if away_m[nearest] <= SAME_PLACE_M else None


def _lower_of(frame: CrossingFrame, person: int) -> float:
    """Return the lower bound of α of the obstacle at a person's place; 0 for none."""
    place_m = frame.truth[person].position_odom_m
    near = [
        (float(np.hypot(*(each.center_odom_m - place_m))), each.awareness_lower)
        for each in frame.constraints.obstacles
    ]
    away_m, lower = min(near, default=(np.inf, 0.0))
    return lower if away_m <= SAME_PLACE_M else 0.0


@dataclass(frozen=True, slots=True)
class Sums:
    """The sums over the crossings of a policy.

    Attributes:
        crossings: their number.
        time_s: time until the goal, or of the whole episode without one.
        impacts: step-out impacts per 1 000 crossings, summed: ``"never"``, ``"past"``,
            ``"looking"`` and ``"answered"``, of which the others hold the last.
        requests: requests for attention.
        touched: contacts of a moving robot.
        people: what came of the requests.
    """

    crossings: int
    time_s: float
    impacts: dict[str, float]
    requests: int
    touched: int
    people: tuple[AskedPerson, ...] = ()

    @classmethod
    def of(cls, episodes: Iterable[tuple[CrossingResult, EpisodeRecord]]) -> Sums:
        """Return the sums over some episodes."""
        results, records = zip(*episodes, strict=True)
        return cls(
            len(records),
            sum(each.time_to_goal_s or each.duration_s for each in records),
            {
                who: float(np.nansum([getattr(each, f"step_out_{who}") for each in records]))
                for who in ("never", "past", "looking", "answered")
            },
            sum(each.requests for each in records),
            sum(each.moving_contacts for each in records),
            tuple(person for each in results for person in asked_people(each)),
        )

    @property
    def all_impacts(self) -> float:
        """The sum of the impacts, whatever people have noticed."""
        return sum(self.impacts[who] for who in ("never", "past", "looking"))

    def seconds_per_impact(self, before: Sums) -> float:
        """Return the seconds won over other crossings for each impact added; inf for none added."""
        won_s, added = before.time_s - self.time_s, self.all_impacts - before.all_impacts
        return won_s / added if added > 0.0 else float("nan") if won_s <= 0.0 else float("inf")


def main() -> None:
    """Print seconds won and impacts added by asking, per crossing and per request.

    Without requests, a bolder policy wins time for impacts, too: asking pays if it wins more
    seconds for each impact. The row of that policy is the exchange to beat.
    """
    parser = argparse.ArgumentParser(prog="python -m benchmarks.asking", description=main.__doc__)
    parser.add_argument("--perception", default="truth", help="as for awarenav crossings")
    parser.add_argument("--scenario", nargs="+", default=["all", "step_out"])
    parser.add_argument("--seeds", type=int, default=3, help="seeds per scenario (default 3)")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--answers", nargs="+", type=float, default=[0.0, 0.5, 1.0])
    parser.add_argument("--population", default="classic")
    parser.add_argument("--policy", default="balanced")
    parser.add_argument("--bolder", default="assertive", help="the policy of the exchange to beat")
    parser.add_argument("--min-gain", type=float, default=AttentionRules().min_gain_s)
    options = parser.parse_args()

    def sums(policy: AwarenessPolicy, population: str) -> Sums:
        seeds = range(options.first_seed, options.first_seed + options.seeds)
        return Sums.of(
            observed_episode(
                job_of(
                    scenario.to_text(),
                    (options.policy, policy_text(policy)),
                    "",
                    seed=seed,
                    perception=options.perception,
                )
            )
            for scenario in named_scenarios(options.scenario, population=population)
            for seed in seeds
        )

    base, bolder = (
        named_policy(name)[1].model_copy(update={"attention": None})
        for name in (options.policy, options.bolder)
    )
    asks = base.model_copy(update={"attention": AttentionRules(min_gain_s=options.min_gain)})
    silent = sums(base, options.population)
    print(
        "| | time, s | never | past | looking | answered | sum | s won a crossing; a request | "
        "impacts added a crossing; a request | s an impact | requests | touched | measured looks\n"
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | ---"
    )
    print(_row("nobody is asked", silent, silent))
    print(_row(f"nobody is asked, {options.bolder}", sums(bolder, options.population), silent))
    for share in options.answers:
        asking = sums(asks, f"{options.population},answers={share:g}")
        print(_row(f"{share:g} answer", asking, silent), flush=True)


def _row(name: str, these: Sums, silent: Sums) -> str:
    """Return a row of the table: figures per crossing, and per request where there are some."""
    count, impacts = these.crossings, these.impacts
    won_s, added = silent.time_s - these.time_s, these.all_impacts - silent.all_impacts

    def both(total: float) -> str:
        a_request = f"; {total / these.requests:.2f}" if these.requests else ""
        return f"{total / count:.2f}{a_request}"

    exchange = "" if these is silent else f"{1000.0 * these.seconds_per_impact(silent):.0f}"
    return (
        f"| {name} | {these.time_s / count:.2f} | "
        + " | ".join(f"{each / count:.2f}" for each in (*impacts.values(), these.all_impacts))
        + f" | {both(won_s)} | {both(added)} | {exchange} | {these.requests / count:.2f} | "
        f"{these.touched} | {_measured(these.people)}"
    )


def _measured(people: Sequence[AskedPerson]) -> str:
    """Return how many true looks were measured, how soon, and how many that were none."""
    answers = [each for each in people if each.look_s is not None]
    delays_s = [each.measured_s for each in answers if each.measured_s is not None]
    if not delays_s:
        return f"0 of {len(answers)}"
    soon = sum(delay_s <= SOON_S + 1e-9 for delay_s in delays_s)
    lasts_s = float(np.median([each.counted_s for each in answers if each.measured_s is not None]))
    others = [each for each in people if each.look_s is None]
    false = sum(each.measured_s is not None for each in others)
    return (
        f"{soon} of {len(answers)} within 1 s, median {float(np.median(delays_s)):.2f} s, for "
        f"{lasts_s:.1f} s; false: {false} of {len(others)}"
    )


if __name__ == "__main__":
    main()
