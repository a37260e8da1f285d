"""The same episodes on a Dask cluster whose workers are killed."""

import contextlib
import os
import signal
import socket
import threading

import pytest
from run_scenes import short_jobs

from sim_tests import SimError
from sim_tests.study.runs import run_jobs

dask = pytest.importorskip("dask")
distributed = pytest.importorskip("distributed")

pytestmark = [
    pytest.mark.slow,
    # Warnings of Dask about its own sockets and event loop.
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


@pytest.fixture
def cluster():
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address=None,
        scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},
    ) as running:
        yield running


def test_a_killed_worker_changes_nothing(cluster, tmp_path):
    jobs = short_jobs(6)
    run_jobs(jobs, tmp_path / "serial", workers=1)
    path = tmp_path / "dask" / "episodes.csv"
    victim = cluster.workers[0].pid
    killed = threading.Event()

    def kill():
        while not path.exists() or path.read_bytes().count(b"\n") < 4:
            killed.wait(0.02)
        os.kill(victim, signal.SIGKILL)
        killed.set()

    killer = threading.Thread(target=kill)
    killer.start()
    run_jobs(jobs, path.parent, scheduler=cluster.scheduler_address)
    killer.join()
    assert killed.is_set()
    assert path.read_bytes() == (tmp_path / "serial" / "episodes.csv").read_bytes()


def test_an_episode_that_kills_every_worker_fails_and_affects_no_other(tmp_path):
    jobs = short_jobs(1) + short_jobs(1, planners=["run_planners:Dies"])[:1]
    # The scheduler gives the episode up after one dead worker; the run sends it once more.
    with dask.config.set({"distributed.scheduler.allowed-failures": 0}):
        records = run_jobs(jobs, tmp_path / "run", workers=2, scheduler="local")
    assert [record.success for record in records] == [True, True, False]
    assert "KilledWorker" in records[2].error


def test_a_run_on_a_local_cluster_needs_no_fixed_port_and_ends_without_log_messages(
    tmp_path, capfd, monkeypatch
):
    # With so many heartbeats, workers would notice a scheduler that ends before them.
    monkeypatch.setattr("distributed.scheduler.heartbeat_interval", lambda workers: 0.01)
    with socket.socket() as first:
        with contextlib.suppress(OSError):  # something else may listen on it already
            first.bind(("127.0.0.1", 8787))
            first.listen()
        records = run_jobs(short_jobs(2), tmp_path / "run", workers=2, scheduler="local")
    assert all(record.success for record in records)
    captured = capfd.readouterr()
    # The workers are processes of their own.
    assert "distributed" not in captured.err + captured.out
    assert "8787" not in captured.err


def test_a_scheduler_that_does_not_answer_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("sim_tests.study.runs._cluster._CONNECT_S", 0.5)
    with pytest.raises(SimError, match="no Dask scheduler answers"):
        run_jobs(short_jobs(1), tmp_path, scheduler="tcp://127.0.0.1:9")
