"""The figures of the safety argument: of the model, of margins and of hazards."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from benchmarks.people import DISPLACEMENTS
from nav_adapter import AwarenessPolicy
from nav_adapter.reach import Reach
from sim_tests.study.report import Table

from ._page import ROBOTS, Standing, rate_left, standings, touched
from ._rows import STEP_OUT, Board

_AWARE, _BLIND, _TODAY, _ = ROBOTS
_WALK_MPS: Final = 1.2


def reach_figures() -> str:
    """Return how far recorded people got, and how far those of each preset may come."""
    times_s = [each[0] for each in DISPLACEMENTS]
    people = "229 people near a robot"
    rows = [
        [f"{people}, {which}", *(f"{each[column]:.2f}" for each in DISPLACEMENTS)]
        for column, which in ((1, "99 %"), (2, "maximum"))
    ]
    for preset in ("assertive", "balanced", "conservative"):
        policy = AwarenessPolicy.named(preset)
        top_mps, delay_s = _speed_mps(policy, aware=False), policy.reach.delay_s
        title = f"`{preset}`: U {top_mps:g} m/s, δ {delay_s:g} s"
        rows.append([title, *(f"{_reach(policy, aware=False).radius_m(t):.2f}" for t in times_s)])
    table = Table(dict.fromkeys(("after", *(f"{t:.1f} s" for t in times_s)), ""), rows).markdown()
    balanced = AwarenessPolicy.named("balanced")
    aware, tau = _reach(balanced, aware=True), balanced.reach.time_constant_s
    leans = " and ".join(f"{aware.radius_m(t):.2f} m in {t:g} s" for t in (0.6, 1.8))
    # A robot that brakes at 1 m/s² and reacts in 0.3 s.
    grows_mps = -aware.speed_mps * math.expm1(-(0.3 + aware.delay_s) / tau)
    return f"{table}\n\n" + _lines(
        [
            f"Somebody who has noticed the robot (`balanced`, U = {aware.speed_mps:g} m/s) leans "
            f"or steps back by {leans}.",
            f"Somebody who walks at {_WALK_MPS:g} m/s and stops does so within "
            f"{_WALK_MPS * tau:.2f} m.",
            f"On the way past somebody who stands and has noticed it (`balanced`), the limit of a "
            f"robot of 1 m/s² and 0.3 s rises by at most {0.01 / grows_mps:.2f} m/s per centimetre "
            f"of room.",
        ]
    )


def margin_figures(board: Board, folder: Path) -> str:
    """Return how often the separation margin of the standards was below 0, and whose."""
    named = {each.row.name: each for each in standings(board, folder)}
    lines = []
    for name, title in (
        (_AWARE, "`balanced`"),
        (_BLIND, "`blind`"),
        (_TODAY, "today's AMR that predicts people"),
    ):
        never = _below(named[name], "min_margin_never_m")
        lines.append(
            f"{title}: in {_below(named[name], 'min_margin_m')}; towards people who had never "
            f"noticed it, in {never}."
        )
    return _lines(lines)


def _below(each: Standing, field: str) -> str:
    found = [value for record in each.ran if (value := getattr(record, field)) is not None]
    below = [value for value in found if value < 0.0]
    worst = f", at worst {min(below):.2f} m".replace("-", "−") if below else ""
    return f"{len(below)} of {len(found)} meetings{worst}"


def hazard_figures(board: Board, folder: Path) -> str:
    """Return the figures of the hazards, of awarenav and of today's AMR."""
    named = {each.row.name: each for each in standings(board, folder)}
    few = Board.read(STEP_OUT)
    steps = {each.row.name: each for each in standings(few, STEP_OUT)}

    def both(scenario: str) -> str:
        """Say how often the two touched somebody in a scenario of people who step out."""
        own, other = (touched(steps[name], scenario) for name in (_AWARE, _TODAY))
        return f"{own} (today's AMR {other})"

    def impacts(name: str, people: str) -> str:
        return named[name].impacts(people).replace(" (", ", at up to ").removesuffix(")")

    return _lines(
        [
            f"H3: of people who had looked and [stepped out](what_it_wins.md#people-who-step-out), "
            f"the moving `balanced` touched {both('steps_out_near_aware')} who stood near, and "
            f"{both('steps_out_far_aware')} who stood farther away; 0 of {few.seeds} leaves a true "
            f"rate of up to {rate_left(few)}.",
            f"H4: of people who step out behind a cart it touched {both('steps_out_behind_cart')}.",
            f"H14: impacts per 1 000 meetings if those who never noticed it start to 1.6 m/s (time "
            f"constant 0.35 s): {impacts(_AWARE, 'stress_never')}; today's AMR "
            f"{impacts(_TODAY, 'stress_never')}.",
            f"H18: impacts per 1 000 meetings with those whose last look is more than 1 s ago: "
            f"{impacts(_AWARE, 'past')}; with `blind` {impacts(_BLIND, 'past')}.",
        ]
    )


def _speed_mps(policy: AwarenessPolicy, *, aware: bool) -> float:
    """Return U of people whose awareness is certain, or none."""
    return policy.speed.human_speed_mps(1.0 if aware else 0.0)


def _reach(policy: AwarenessPolicy, *, aware: bool) -> Reach:
    speed_mps = _speed_mps(policy, aware=aware)
    tau, delay_s = policy.reach.time_constant_s, policy.reach.delay_s
    return Reach(0.0, 0.0, 0.0, 0.0, speed_mps, tau, delay_s)


def _lines(lines: Iterable[str]) -> str:
    return "\n".join(
        textwrap.fill(f"- {line}", 100, subsequent_indent="  ", break_on_hyphens=False)
        for line in lines
    )
