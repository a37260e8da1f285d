"""Folders as a run leaves them, with made-up episodes: what reports are tried on."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sim_tests.study.measures import EpisodeRecord, write_records
from sim_tests.study.runs import Job

#: Scenario, its attention, and the seconds that a blind robot loses in it.
SCENARIOS = (
    ("crossing_from_the_left", "attentive", 4.1),
    ("crossing_from_the_right", "attentive", 4.4),
    ("late_glance", "mixed", 4.6),
    ("reads_a_phone", "unaware", 5.2),
    ("runs_out", "unaware", 3.2),
    ("head_on_in_an_aisle", "attentive", 6.8),
)
#: Policy, perception, share kept of what blind loses with attentive, mixed and unaware people.
POLICIES = (
    ("blind", "keypoints", (1.0, 1.0, 1.0)),
    ("balanced", "keypoints", (0.46, 0.74, 0.99)),
    ("oracle", "truth", (0.33, 0.58, 0.97)),
)
_PLACES = {"attentive": 0, "mixed": 1, "unaware": 2}


@dataclass(frozen=True)
class MadeUpRun:
    """The content of a run: episodes, their jobs in the same order, and what ``run.json`` says."""

    records: tuple[EpisodeRecord, ...]
    jobs: tuple[Job, ...]
    run: dict[str, Any]

    def write(self, out: Path) -> Path:
        """Write the three files of a run."""
        out.mkdir(parents=True, exist_ok=True)
        write_records(out / "episodes.csv", self.records)
        lines = [json.dumps(asdict(job)) for job in self.jobs]
        (out / "jobs.jsonl").write_text("".join(f"{line}\n" for line in lines), "utf-8")
        (out / "run.json").write_text(json.dumps(self.run, indent=2), "utf-8")
        return out


def made_up_run(
    *,
    scenarios: int = len(SCENARIOS),
    seeds: int = 20,
    policies: Sequence[str] = tuple(name for name, _, _ in POLICIES),
    faults: Sequence[str] = (),
    seed: int = 0,
) -> MadeUpRun:
    """Episodes as likely as real ones: paired over policies, skewed, some never arriving."""
    rng, fault_rng = np.random.default_rng(seed).spawn(2)
    records: list[EpisodeRecord] = []
    jobs: list[Job] = []
    for name, attention, lost_s in SCENARIOS[:scenarios]:
        for episode_seed in range(seeds):
            common = rng.standard_normal(6)
            for policy, perception, kept in POLICIES:
                if policy not in policies:
                    continue
                for fault in ("", *faults):
                    if fault and policy != "balanced":
                        continue
                    own = (fault_rng if fault else rng).standard_normal(6)
                    record = _episode(
                        EpisodeRecord(name, episode_seed, policy, "ReferencePlanner", perception),
                        attention,
                        fault,
                        lost_s * kept[_PLACES[attention]],
                        0.8 * common + 0.6 * own,
                    )
                    records.append(record)
                    jobs.append(
                        Job(
                            *(name, episode_seed, policy, "ReferencePlanner", perception),
                            fault=fault,
                            scenario_text=f"name: {name}\nversion: 1\nattention: {attention}\n",
                            policy_text="inflation: {shape: linear}\n",
                            fault_text=f"name: {fault}\n" if fault else "",
                        )
                    )
    run = {
        "command": "awarenav crossings --scenario all --episodes 20 --policy blind balanced oracle "
        "--perception keypoints --out crossings",
        "versions": {
            "awarenav": "0.1.0",
            "python": "3.11.9",
            "numpy": "2.4.6",
            "pybullet": "3.2.7",
        },
        "settings": {"seed": 0, "episodes": seeds, "workers": 2, "perception": "keypoints"},
    }
    return MadeUpRun(tuple(records), tuple(jobs), run)


def _episode(
    task: EpisodeRecord, attention: str, fault: str, lost_s: float, z: np.ndarray
) -> EpisodeRecord:
    free_s = 11.0 + 0.4 * float(z[0])
    delay_s = max(lost_s * float(np.exp(0.35 * z[1])) + (1.1 if fault else 0.0), 0.0)
    arrived = bool(z[2] < 2.45)
    margin_m = 0.42 + 0.33 * float(z[3]) - (0.45 if task.scenario == "runs_out" else 0.0)
    walked_into = bool(z[4] < -2.6)
    return replace(
        task,
        success=arrived,
        contact=walked_into,
        contact_by="person" if walked_into else "",
        contacts=int(walked_into),
        person_contacts=int(walked_into),
        min_separation_m=0.0 if walked_into else max(0.55 + 0.4 * margin_m, 0.05),
        time_to_goal_s=free_s + delay_s if arrived else None,
        min_margin_m=margin_m,
        violation_time_s=max(-margin_m, 0.0) * 1.4,
        duration_s=free_s + delay_s if arrived else 40.0,
        attention=attention,
        fault=fault,
        time_without_people_s=free_s,
        time_lost_s=delay_s if arrived else 40.0 - free_s,
        speed_at_min_separation_mps=float(np.clip(0.35 + 0.22 * z[4], 0.0, 1.5)),
        human_delay_s=max(0.3 + 0.4 * float(z[0]), 0.0),
        awareness="aware" if attention == "attentive" else "unaware",
        attentive_share={"attentive": 0.97, "mixed": 0.5, "unaware": 0.0}[attention],
    )


def failed(record: EpisodeRecord, why: str) -> EpisodeRecord:
    """The same episode, had it failed."""
    return EpisodeRecord(
        record.scenario,
        record.seed,
        record.policy,
        record.planner,
        record.perception,
        attention=record.attention,
        fault=record.fault,
        error=why,
    )
