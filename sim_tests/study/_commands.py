"""The work of ``awarenav crossings`` and ``awarenav watch``."""

from __future__ import annotations

import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from awarenav.errors import counted
from awarenav.files import check_output, json_text, require_writable
from perception import AwarenessPipeline, Camera

from ..conditions import Experiment
from ..crossing import drive
from ..viewing import LivePage, outcome_text, page_text, show_page, write_page
from ..world.bullet import require_pybullet
from ..world.errors import SimError
from .measures import (
    nondeterminism_notes,
    short_text,
    summarise,
)
from .runs import (
    Job,
    RunFiles,
    about_run,
    experiment_jobs,
    recorder_of,
    run_jobs,
    sample_jobs,
    setup_of,
)

# Rendering takes at most this share of the time, so that states arrive often.
_PICTURE_SHARE: Final = 0.25
_DELIVERY_S: Final = 5.0
_CATCH_UP_S: Final = 0.3


def crossings_command(
    experiment: Experiment,
    *,
    out: Path,
    sample: int | None,
    time_limit: float | None,
    no_report: bool,
    as_json: bool,
    **running: Any,
) -> int:
    """Run episodes, print a short table, write the report.

    All errors are raised before anything runs.
    """
    jobs = experiment_jobs(experiment)
    sees = experiment["perception"] == "pixels" and any(
        "camera" in each.split("+") for each in experiment["sensors"]
    )
    if sees and not experiment["networks"]:
        # Refuses missing networks before anything runs; the plan loads others.
        AwarenessPipeline(Camera.from_fov(640, 480, 1.0), simulator_networks=True)
    if sample is not None:
        jobs = sample_jobs(jobs, sample, experiment["seed"])
    records = run_jobs(
        jobs,
        out,
        time_limit_s=time_limit,
        progress=True,
        about=about_run(experiment, "crossings", out, sample=sample),
        **running,
    )
    summary = summarise(records)
    if as_json:
        print(json_text([asdict(row) for row in summary.policies]), end="")
    else:
        print(short_text(summary))
        print(f"\nWritten to {out}: episodes.csv with {counted(len(records), 'episode')}")
    for note in nondeterminism_notes(records):
        print(note, file=sys.stderr)
    failed = [number for number, record in enumerate(records) if record.error]
    if failed:
        first = records[failed[0]]
        print(
            f"{len(failed)} of {counted(len(records), 'episode')} failed; episode {failed[0]} "
            f"({first.scenario}, seed {first.seed}): {first.error}\n"
            f"{RunFiles(out).errors} has the tracebacks",
            file=sys.stderr,
        )
    if not no_report:
        _write_report(out, as_json=as_json)
    return 1 if failed else 0


def _write_report(out: Path, *, as_json: bool) -> None:
    try:
        from .report import write_report  # noqa: PLC0415 - needs the extra bench

        path = write_report(out, progress=True)
    except SimError as error:  # the episodes are complete; the report can be made later
        print(f"no report: {error}; then: awarenav report {out}", file=sys.stderr)
        return
    print(f"Report: {path}", file=sys.stderr if as_json else sys.stdout)


def watch_command(
    experiment: Experiment,
    *,
    speed: float,
    port: int,
    wait: float,
    out: Path | None,
    no_camera: bool,
    no_browser: bool,
) -> int:
    """Serve the page, run the crossing at the pace of the clock, and end with it."""
    require_pybullet()
    job = _job(experiment)
    if out is not None:
        check_output(out, (".html",))
        require_writable(out.parent, SimError)
    with LivePage(page_text(f"awarenav watch: {job.scenario}"), port) as page:
        print(f"{job.conditions.text}\nWatch it at {page.url} (Ctrl-C ends it)", flush=True)
        if not no_browser:
            show_page(page.url)
        pace = _Pace(page, speed, wait)
        recorder = recorder_of(
            job,
            camera=not no_camera,
            share=_PICTURE_SHARE,
            on_begin=pace.begin,
            on_state=pace.state,
        )
        result = drive(setup_of(job), recorder)
        outcome = outcome_text(result)
        page.end(outcome, recorder.note)
        page.wait_for_delivery(_DELIVERY_S)
        print(f"{outcome}.", flush=True)
        if not page.opened:
            print("Nobody opened the page.")
    if out is not None:
        write_page(out, recorder.begin, recorder.states, outcome, recorder.note)
        print(f"Written: {out}")
    return 0


class _Pace:
    """Sends states to a page, not before their time.

    The clock starts when somebody reads the page, or after ``wait_s``.
    """

    def __init__(self, page: LivePage, speed: float, wait_s: float) -> None:
        self._page = page
        self._speed = speed
        self._open_until = time.monotonic() + wait_s
        self._started = 0.0

    def begin(self, begin: dict[str, Any]) -> None:
        """Send hall and robot; wait for a reader."""
        self._page.begin(begin)
        left_s = self._open_until - time.monotonic()
        if not self._page.wait_for_reader(max(left_s, 0.0)):
            print("Nobody has opened the page yet; the crossing starts.", flush=True)
        self._started = time.monotonic()

    def state(self, state: dict[str, Any]) -> None:
        """Send a state when its time has come."""
        due = self._started + state["t_s"] / self._speed
        late_s = time.monotonic() - due
        time.sleep(max(-late_s, 0.0))
        # A slow computer sets its own pace; only a short delay, as of a picture, is made up for.
        self._started += max(late_s - _CATCH_UP_S, 0.0)
        self._page.state(state)


def _job(experiment: Experiment) -> Job:
    """Return the job of the options, as a run of ``awarenav crossings`` would plan it."""
    jobs = experiment_jobs(experiment)
    if len(jobs) != 1:
        scenario, fault = experiment.one("scenario"), experiment.one("fault")
        raise SimError(
            f"watch shows one crossing, but scenario {scenario!r} with fault {fault!r} stands for "
            f"{len(jobs)}; give one of each"
        )
    return jobs[0]
