"""Kill a command again and again at random instants, and resume it; a program for test_kills.py.

The command runs in forks of this process, which has run it once, so that imports and caches are
warm and the kills fall into its work. Ends with status 1 at the first difference.
"""

from __future__ import annotations

import contextlib
import json
import os
import random
import shutil
import signal
import sys
import time
from pathlib import Path

import cv2

from awarenav.cli import main


def fork(words: list[str], log: Path) -> int:
    """Run a command in a fork of this process; return its process id."""
    process = os.fork()
    if process:
        return process
    status = 70
    try:
        with log.open("a") as file, contextlib.redirect_stdout(file):
            os.dup2(file.fileno(), 2)
            status = main(words)
    finally:
        os._exit(status)


def finish(words: list[str], log: Path) -> int:
    """Run a command in a fork of this process; return its exit status."""
    return os.waitstatus_to_exitcode(os.waitpid(fork(words, log), 0)[1])


def results(out: Path, patterns: list[str]) -> dict[str, bytes]:
    """Return the files that must not depend on kills."""
    folder = out.parent if out.suffix else out
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for pattern in patterns
        for path in folder.glob(pattern)
    }


def run(task: dict) -> int:
    """Do the task; return the exit status of this program."""
    cv2.setNumThreads(1)  # a fork has none of its parent's threads
    folder = Path(task["folder"])
    log, random_s = folder / "log", random.Random(task["seed"])
    whole, killed = (folder / name / task["out"] for name in ("whole", "killed"))
    whole.parent.mkdir()
    words = [*task["words"], "--out"]
    with log.open("a") as file, contextlib.redirect_stdout(file), contextlib.redirect_stderr(file):
        expected_status = main([*words, str(whole)])
    expected = results(whole, task["results"])
    killed.parent.mkdir()
    start_s = time.monotonic()
    status = finish([*words, str(killed)], log)
    duration_s = time.monotonic() - start_s
    if (
        expected_status not in (0, 1)
        or not expected
        or results(killed, task["results"]) != expected
    ):
        print(f"without kills: status {expected_status}, {status}: {log.read_text()[-2000:]}")
        return 1
    kills = attempts = 0
    while kills < task["kills"] and attempts < 5 * task["kills"]:
        attempts += 1
        shutil.rmtree(killed.parent, ignore_errors=True)
        killed.parent.mkdir()
        lived_s = kill_after(random_s.uniform(0.0, duration_s), fork([*words, str(killed)], log))
        if lived_s is not None:  # the work is faster by now
            duration_s = min(duration_s, lived_s)
            continue
        kills += 1
        status = finish([*words, str(killed), "--resume"], log)
        if status == 2:  # nothing to resume: it was killed before it began
            status = finish([*words, str(killed)], log)
        found = results(killed, task["results"])
        if status != expected_status or found != expected:
            names = [name for name in {*found, *expected} if found.get(name) != expected.get(name)]
            print(f"kill {kills}: status {status}, {names} differ: {log.read_text()[-2000:]}")
            return 1
        damaged = sorted(str(path) for path in killed.parent.rglob("*.damaged"))
        if damaged:
            print(f"kill {kills} made damaged lines: {damaged}")
            return 1
    print(f"{kills} kills at random instants in {duration_s:.2f} s of work")
    return 0 if kills == task["kills"] else 1


def kill_after(pause_s: float, process: int) -> float | None:
    """Kill a process after a pause; return how long it lived if it ended before."""
    start_s = time.monotonic()
    while time.monotonic() < start_s + pause_s:
        if os.waitpid(process, os.WNOHANG)[0]:
            return time.monotonic() - start_s
        time.sleep(0.002)
    os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)
    return None


if __name__ == "__main__":
    sys.exit(run(json.loads(sys.argv[1])))
