"""The data of a run as reports read them, and its figures by arm."""

from __future__ import annotations

import os
import shlex
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from awarenav.errors import counted

from ...world.errors import SimError
from ..measures import (
    ATTENTIVE_FROM,
    BASELINE,
    FEW_PAIRS,
    OVERSHOOT_MPS,
    THIN,
    Comparison,
    EpisodeRecord,
    Interval,
    Summary,
    SummaryRow,
    Variant,
    labels,
    measured_part,
    number_text,
    paired,
    percent,
    proportion_interval,
    summarise,
)
from ..runs import Attempt, Job, RunFiles, read_attempts, read_jobs, read_rows, read_run

#: Key in ``run.json`` of the policy with wider radii, by which planners are probed.
WIDE_KEY: Final = "wide_policy"
#: The policy that knows the truth: a bound, and no candidate.
CEILING: Final = "oracle"
# Arms are shown in this order; candidates lie between.
_ORDER: Final = {BASELINE: 0, CEILING: 2}


@dataclass(frozen=True, slots=True)
class Run:
    """The data in the folder of a run.

    Attributes:
        path: the folder, as given.
        episodes: the episodes that have ended, in the order of the jobs.
        jobs: the jobs by their numbers; empty where they cannot be read.
        about: content of ``run.json``; empty where it cannot be read.
        missing: sentences on what is missing or unfinished.
    """

    path: Path
    episodes: tuple[Attempt, ...]
    jobs: tuple[Job, ...]
    about: dict[str, Any]
    missing: tuple[str, ...]

    @classmethod
    def read(cls, path: Path | str) -> Run:
        """Read a folder; ``episodes.csv`` alone is enough.

        Raises:
            SimError: it holds no episodes, or a file of an episode cannot be read.
        """
        path, missing = Path(path), []
        files, about = RunFiles(path), read_run(Path(path))
        try:
            jobs = read_jobs(path)
        except SimError:
            jobs = ()
            missing.append(f"{files.jobs.name} cannot be read: episodes have no replay command.")
        if not about:
            missing.append(
                f"{files.run.name} cannot be read: the command and the versions are not known."
            )
        if attempts := read_attempts(path) if jobs else {}:
            episodes = list(attempts.values())
        else:
            records = read_rows(path)
            # A whole table is in the order of its jobs.
            is_whole = len(records) == len(jobs) and all(map(_fits, jobs, records))
            numbers = range(len(jobs)) if is_whole else [None] * len(records)
            pairs = zip(records, numbers, strict=True)
            episodes = [Attempt(record, number=number) for record, number in pairs]
        if waiting := max(len(jobs) - len(episodes), 0):
            missing.append(
                f"{waiting} of {counted(len(jobs), 'episode')} did not run yet; the same command "
                "with --resume goes on."
            )
        return cls(path, tuple(episodes), jobs, about, tuple(missing))

    @property
    def wide_policy(self) -> str:
        """Name of the policy of the probe of wider radii; empty without a probe."""
        return str(self.about.get(WIDE_KEY, ""))

    def replay(self, episode: Attempt) -> str:
        """Return the command that replays an episode; empty where its job is not known."""
        if episode.number is None:
            return ""
        return f"awarenav replay {shlex.quote(str(self.path))} {episode.number}"

    def page(self, episode: Attempt, folder: Path) -> str:
        """Return the address of an episode's replay page, from a folder; empty without a page."""
        if episode.number is None:
            return ""
        page = RunFiles(self.path).page(episode.number)
        return quote(Path(os.path.relpath(page, folder)).as_posix()) if page.is_file() else ""


def _fits(job: Job, record: EpisodeRecord) -> bool:
    """Return whether a row can be that of a job."""
    return job.conditions == record.conditions


@dataclass(frozen=True, slots=True)
class Arm:
    """One arm of the comparison, in the sense of a clinical trial."""

    name: str
    variant: Variant
    row: SummaryRow
    episodes: tuple[Attempt, ...]
    others: tuple[Attempt, ...]


@dataclass(frozen=True, slots=True)
class Results:
    """The figures of a run, by arm.

    Attributes:
        fault: fault of the episodes in every section but the table of faults; empty for none,
            which is preferred.
        arms: those with episodes under that fault, the reference ``blind`` first.
        summary: summary of the episodes under that fault.
        probe: episodes of the probe of wider radii, which are in no arm.
    """

    fault: str
    arms: tuple[Arm, ...]
    summary: Summary
    probe: tuple[Attempt, ...]

    @classmethod
    def of(cls, run: Run) -> Results:
        """Return the figures of a run."""
        probe = tuple(each for each in run.episodes if each.record.policy == run.wide_policy)
        own = [each for each in run.episodes if each.record.policy != run.wide_policy]
        faults = [each.record.fault for each in own if not each.record.error]
        fault = "" if "" in faults or not faults else faults[0]
        records = [each.record for each in own if each.record.fault == fault]
        summary = summarise(records)
        name_of = labels(map(Variant.of, records))
        rows = {row.variant: row for row in summary.policies}
        arms = []
        for variant, name in name_of.items():
            found = [
                each
                for each in own
                if replace(Variant.of(each.record), fault=variant.fault) == variant
            ]
            arms.append(
                Arm(
                    name,
                    variant,
                    rows[name],
                    tuple(each for each in found if each.record.fault == fault),
                    tuple(each for each in found if each.record.fault != fault),
                )
            )
        arms.sort(key=lambda arm: _ORDER.get(arm.variant.policy, 1))
        return cls(fault, tuple(arms), summary, probe)

    @property
    def judged(self) -> tuple[Arm, ...]:
        """The arms that verdicts are about: all but ``blind`` and ``oracle``, unless none is."""
        return tuple(arm for arm in self.arms if arm.variant.policy not in _ORDER) or self.arms

    def against(self, arm: Arm, part: str = "") -> Comparison | None:
        """Return the comparison of an arm with ``blind`` and the same planner; None without one."""
        found = (each for each in self.summary.comparisons if each.variant == arm.name)
        return next((each for each in found if each.part == part), None)

    def verdict(self, arm: Arm) -> str:
        """Return the sentences about an arm that are read first; they claim what is shown.

        The first line has the worst of all its episodes, with and without faults.
        """
        episodes = (*arm.episodes, *arm.others)
        ran = [each for each in episodes if not each.record.error]
        if not ran:
            return "No episode finished, so nothing can be said."
        worst = " ".join(filter(None, [_margins(ran), _obeys(ran), _goals(episodes)]))
        said = [f"{worst}\n{_contacts(ran)}"]
        whole = self.against(arm)
        if whole is None:
            if arm.variant.policy != BASELINE:
                said.append(f"What awareness saves is not known: {BASELINE} did not run.")
            return " ".join(said)
        note = self._left_out(arm, whole)
        said.append(_faster("people", whole))
        attentive = self.against(arm, "attentive")
        if attentive is not None and attentive.time_lost_s.n < whole.time_lost_s.n:
            said.append(_faster("attentive people", attentive))
        elif attentive is None and note:
            said.append("Nobody was measured to be attentive.")
        unaware = self.against(arm, "unaware")
        said.append(_violates(unaware or whole, "people" if unaware is None else "unaware people"))
        return " ".join(filter(None, [*said, note]))

    def _left_out(self, arm: Arm, whole: Comparison) -> str:
        """Return the sentence on pairs that are attentive by the label of their scenario alone."""
        base = next(each for each in self.arms if each.name == whole.baseline)
        names = Counter(
            first.versioned_scenario
            for first, second in paired(*([e.record for e in a.episodes] for a in (base, arm)))
            if first.attention == "attentive"
            and not all(measured_part(each) == "attentive" for each in (first, second))
        )
        if not names:
            return ""
        listed = ", ".join(f"{name} {number}" for name, number in names.items())
        return (
            f"Not counted as attentive: {counted(names.total(), 'pair')} labelled attentive "
            "in which somebody was not measured to be aware of the robot for "
            f"{percent(ATTENTIVE_FROM)} of the time ({listed})."
        )


def moving_contacts(episodes: Sequence[Attempt]) -> Interval:
    """Return the share of episodes in which a person and the moving robot touched."""
    return proportion_interval(sum(each.record.moving_touched for each in episodes), len(episodes))


def _contacts(ran: Sequence[Attempt]) -> str:
    share = moving_contacts(ran)
    touched, total = share.count, counted(share.n, "episode")
    if not touched:
        return (
            f"The moving robot touched nobody in {total}; a true rate of up to "
            f"{percent(share.high)} remains possible."
        )
    by_robot = sum(each.record.robot_touched for each in ran)
    return (
        f"A person and the moving robot touched in {touched} of {total} ({percent(share.value)}): "
        f"look at these first. The robot moved into the person in {by_robot} of them."
    )


def _margins(ran: Sequence[Attempt]) -> str:
    """Return the sentence on the smallest separation margin of all episodes."""
    margins_m = [e.record.min_margin_m for e in ran if e.record.min_margin_m is not None]
    if not margins_m:
        return "The robot never moved near anybody."
    below = sum(margin_m < 0.0 for margin_m in margins_m)
    where = (
        f"below 0 in {below} of {counted(len(margins_m), 'episode')}" if below else "never below 0"
    )
    return f"The worst margin is {number_text(min(margins_m))} m, {where}."


def _obeys(ran: Sequence[Attempt]) -> str:
    """Return the sentence on the speed limit; empty where the conduct is not known."""
    conducts = [each.conduct for each in ran if each.conduct is not None]
    excesses = {
        "the speed limit": [each.limit_excess_mps for each in conducts],
        "the limit of its fastest point": [each.fastest_point_excess_mps for each in conducts],
    }
    known = {rule: [each for each in of if each is not None] for rule, of in excesses.items()}
    if not any(known.values()):
        return ""
    over = [
        f"{rule} in {sum(each > OVERSHOOT_MPS for each in of)} of "
        f"{counted(len(of), 'episode')}, by up to {max(of):.2f} m/s"
        for rule, of in known.items()
        if max(of, default=0.0) > OVERSHOOT_MPS
    ]
    return f"It exceeds {' and '.join(over)}." if over else "It obeys the speed limit."


def _goals(episodes: Sequence[Attempt]) -> str:
    missed = sum(each.record.time_to_goal_s is None for each in episodes)
    if not missed:
        return "It misses no goal."
    return f"It misses the goal in {missed} of {counted(len(episodes), 'episode')}."


def _faster(who: str, against: Comparison) -> str:
    """Return the sentence on the seconds that a meeting costs less than with ``blind``."""
    change = against.time_lost_s
    if not change.known:
        return f"No pair tells whether it is faster than {BASELINE}."
    pairs, more = counted(change.n, "pair"), "more"
    if change.value <= 0.0:
        more = "less"
        change = replace(change, value=-change.value, low=-change.high, high=-change.low)
    text = f"a meeting with {who} takes {change.text(1)} s {more} than with {BASELINE}"
    if change.n < FEW_PAIRS:
        return f"Over only {pairs}, {text}: too few to tell."
    if change.low <= 0.0 <= change.high:
        return f"A{text[1:]} ({pairs}): no difference is shown."
    return f"A{text[1:]} ({pairs})."


def _violates(against: Comparison, who: str) -> str:
    change, base, decimals = against.violation_excess, "violation time", 0
    if not change.known:  # the reference violates nothing
        change, base, decimals = against.violation_excess_of_time, "driving time", 1
    if not change.known:
        return ""
    text = f"{change.text(decimals, 100.0)}{THIN}% of {BASELINE}'s {base}"
    if change.n < FEW_PAIRS or change.low <= 0.0 <= change.high:
        return f"Whether its margins with {who} are negative for longer is not shown: {text}."
    return (
        f"With {who}, margins are negative {'longer' if change.value > 0.0 else 'shorter'}: {text}."
    )


def worst_first(episode: Attempt) -> tuple[int, float, tuple[str, int, int]]:
    """Return a sort key: contacts with the moving robot, then errors, then the smallest margins."""
    record = episode.record
    severity = 0 if record.moving_touched else 1 if record.error else 2
    margin = float("inf") if record.min_margin_m is None else record.min_margin_m
    return severity, margin, (record.scenario, record.scenario_version, record.seed)


def outcome_of(episode: Attempt) -> str:
    """Return a remark on the outcome of an episode; empty for a success."""
    record = episode.record
    if record.error:
        return f"failed: {record.error}"
    if record.robot_touched:
        return "robot moved into a person"
    if record.moving_touched:
        return "a person walked into the moving robot"
    if record.person_contacts:
        return "a person walked into the robot"
    if record.bumps:
        return "robot ran into a rack or a wall"
    return "goal not reached" if record.time_to_goal_s is None else ""
