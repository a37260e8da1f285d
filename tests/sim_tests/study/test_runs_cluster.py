"""The same episodes by one worker and on a Dask cluster one of whose workers is killed."""

import os
import signal
import threading

import pytest
from run_scenes import short_jobs

from sim_tests import SimError
from sim_tests.study.runs import run_jobs

dask = pytest.importorskip("dask")
distributed = pytest.importorskip("distributed")

pytestmark = [
    # Warnings of Dask about its own sockets and event loop.
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


@pytest.mark.slow
def test_a_cluster_on_this_computer_gives_the_same_table(tmp_path, capfd):
    jobs = short_jobs(2)
    run_jobs(jobs, tmp_path / "serial", workers=1)
    run_jobs(jobs, tmp_path / "dask", workers=2, scheduler="local")
    table = (tmp_path / "dask" / "episodes.csv").read_bytes()
    assert table == (tmp_path / "serial" / "episodes.csv").read_bytes()
    captured = capfd.readouterr()
    assert "distributed" not in captured.err + captured.out


@pytest.mark.full
def test_an_episode_that_kills_its_worker_affects_no_other(tmp_path):
    jobs = short_jobs(1) + short_jobs(1, planners=["run_planners:Dies"])[:1]
    # The scheduler gives the episode up after one dead worker; the run sends it once more.
    with dask.config.set({"distributed.scheduler.allowed-failures": 0}):
        records = run_jobs(jobs, tmp_path / "run", workers=2, scheduler="local")
    assert [record.success for record in records] == [True, True, False]
    assert "died, and so did a second one (KilledWorker)" in records[2].error


@pytest.mark.full
def test_a_killed_worker_of_a_cluster_changes_nothing(tmp_path):
    jobs = short_jobs(6)
    run_jobs(jobs, tmp_path / "serial", workers=1)
    killed = threading.Event()
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address=None,
        scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},
    ) as cluster:
        victim = cluster.workers[0].pid

        def kill():
            while len(list(tmp_path.glob("dask/episodes/*.json"))) < 3:
                killed.wait(0.02)
            os.kill(victim, signal.SIGKILL)
            killed.set()

        killer = threading.Thread(target=kill)
        killer.start()
        run_jobs(jobs, tmp_path / "dask", scheduler=cluster.scheduler_address)
        killer.join()
    assert killed.is_set()
    table = (tmp_path / "dask" / "episodes.csv").read_bytes()
    assert table == (tmp_path / "serial" / "episodes.csv").read_bytes()


def test_a_scheduler_that_does_not_answer_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("sim_tests.study.runs._parallel._CONNECT_S", 0.5)
    with pytest.raises(SimError, match="no Dask scheduler answers"):
        run_jobs(short_jobs(1), tmp_path, scheduler="tcp://127.0.0.1:9")
