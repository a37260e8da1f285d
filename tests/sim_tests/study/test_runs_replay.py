"""Replays: an episode again, with its pictures, and whether its row is the same."""

import pytest
from run_scenes import short_jobs

from awarenav.cli import main
from sim_tests.study.report import write_report
from sim_tests.study.runs import run_jobs


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    run_jobs(short_jobs(1, faults=["none", "misses_30"]), folder, workers=1)
    return folder


def test_a_replay_gives_the_same_row_a_video_and_a_map(run, tmp_path, capsys):
    assert main(["replay", str(run), "1", "--out", str(tmp_path)]) == 0
    text = capsys.readouterr().out
    assert "Episode 1: short, seed 0, policy balanced" in text
    assert "The same row as in" in text
    assert (tmp_path / "episode_00001.png").read_bytes().startswith(b"\x89PNG")
    assert b"ftyp" in (tmp_path / "episode_00001.mp4").read_bytes()[:16]


def test_a_replay_with_another_row_names_the_difference(run, tmp_path, capsys):
    copy = tmp_path / "copy"
    copy.mkdir()
    rows = (run / "episodes.csv").read_text().replace(",true,false,,", ",false,false,,")
    (copy / "episodes.csv").write_text(rows)
    (copy / "jobs.jsonl").write_bytes((run / "jobs.jsonl").read_bytes())
    assert main(["replay", str(copy), "short:0:blind:misses_30", "--no-video"]) == 1
    assert "success was false, is true" in capsys.readouterr().out
    assert [path.name for path in (copy / "replays").iterdir()] == ["episode_00002.png"]


def test_the_report_links_to_the_pages_of_replays(tmp_path, capsys):
    folder = tmp_path / "a run"
    run_jobs(short_jobs(1), folder, workers=1)
    assert main(["replay", str(folder), "1", "--view"]) == 0
    text = capsys.readouterr().out
    page = folder / "replays" / "episode_00001.html"
    assert f"Written: {page}" in text
    assert "The same row as in" in text
    assert [path.name for path in page.parent.iterdir()] == [page.name]
    assert '"scenario":"short","seed":0,"policy":"balanced"' in page.read_text()
    report = write_report(folder, stills=False).read_text()
    assert report.count('<a href="replays/episode_00001.html">Watch</a>') == 1
    assert f"awarenav replay &#39;{folder}&#39; 0 --view" in report
    assert f"awarenav replay &#39;{folder}&#39; 1 --view" not in report
    elsewhere = write_report(folder, stills=False, path=tmp_path / "report.html").read_text()
    assert '<a href="a%20run/replays/episode_00001.html">Watch</a>' in elsewhere
    assert main(["replay", str(folder), "all", "--view"]) == 0
    report = write_report(folder, stills=False).read_text()
    assert report.count(">Watch</a>") == 2
