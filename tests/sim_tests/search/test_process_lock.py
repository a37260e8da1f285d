"""The lock of a folder: one process at a time, and free again when its holder is gone."""

import subprocess
import sys
import threading

import pytest

from sim_tests import SimError
from sim_tests.search import ProcessLock

HOLDER = """
import sys, time
from pathlib import Path
from sim_tests.search import ProcessLock
lock = ProcessLock(Path(sys.argv[1]))
print("held", flush=True)
time.sleep(600.0)
"""


def test_a_lock_is_free_again_when_its_holder_releases_it(tmp_path):
    path = tmp_path / "a.lock"
    with ProcessLock(path) as lock:
        assert lock.held
        assert not ProcessLock(path, wait=False).held
    assert not lock.held
    with ProcessLock(path, wait=False) as again:
        assert again.held


def test_a_lock_is_free_again_when_its_holder_is_killed(tmp_path):
    path = tmp_path / "folder" / "a.lock"
    command = [sys.executable, "-c", HOLDER, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline() == "held\n"
        assert not ProcessLock(path, wait=False).held
        holder.kill()
    with ProcessLock(path, wait=False) as lock:
        assert lock.held


def test_a_waiting_process_gets_the_lock_when_it_is_released(tmp_path):
    path = tmp_path / "a.lock"
    held = []

    def wait() -> None:
        with ProcessLock(path) as second:
            held.append(second.held)

    with ProcessLock(path):
        waiting = threading.Thread(target=wait)
        waiting.start()
        waiting.join(0.2)
        assert waiting.is_alive()
        assert not held
    waiting.join()
    assert held == [True]


def test_a_lock_that_cannot_be_written_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SimError, match="cannot write"):
        ProcessLock(tmp_path / "file" / "a.lock")
