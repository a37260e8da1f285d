"""The headline on attentive people counts measured attention alone; numbers agree with nouns."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from page_reader import PageReader
from report_runs import MadeUpRun, failed, made_up_run

from awarenav.cli import main
from awarenav.judge import judge_frames, markdown_report
from awarenav.records import people_by_frame
from sim_tests.study.measures import summarise, won_back
from sim_tests.study.report import percent, write_report

# Several of a thing, where there is one of it.
_ONE_MANY = re.compile(
    r"(?<![\d.,\u202f\N{MINUS SIGN}–])\b1 (?:\w+ )?(episodes|crossings|scenarios|policies|seeds|"
    r"pairs|rows|lines|numbers|frames|people|draws|trials|images|marks|others|measures|contacts|"
    r"estimates)\b"
)


def page_of(run: MadeUpRun, out: Path) -> PageReader:
    return PageReader(write_report(run.write(out), stills=False).read_text("utf-8"))


def with_shares(run: MadeUpRun, share, scenario: str = "") -> MadeUpRun:
    """The run with another ``attentive_share``, in one scenario or in all."""
    records = tuple(
        replace(each, attentive_share=share) if scenario in ("", each.scenario) else each
        for each in run.records
    )
    return replace(run, records=records)


def test_pairs_of_people_who_do_not_watch_are_named_and_left_out(tmp_path: Path) -> None:
    run = with_shares(made_up_run(seeds=8), 0.4, "crossing_from_the_left")
    page = page_of(run, tmp_path)
    assert (
        "8 pairs labelled attentive are left out of the time won back, because not everybody was "
        f"aware of the robot for {percent(0.8)} of the time: crossing_from_the_left 8." in page.text
    )
    counted = [
        [
            record
            for record in run.records
            if record.policy == policy
            and record.attention == "attentive"
            and record.scenario != "crossing_from_the_left"
        ]
        for policy in ("blind", "balanced")
    ]
    value = percent(won_back(*counted).value)
    assert f"It wins back {value} of the time that blind loses to attentive people" in page.text
    assert f"{len(counted[0])} pairs" in page.text
    assert "balanced, unconfirmed" in page.text
    assert "attentive, 24 of 24 not" in page.text


def test_one_pair_is_left_out_in_the_singular(tmp_path: Path) -> None:
    run = made_up_run(seeds=4)
    records = list(run.records)
    index = next(
        n
        for n, each in enumerate(records)
        if each.attention == "attentive" and each.policy == "balanced"
    )
    records[index] = replace(records[index], attentive_share=0.79)
    page = page_of(replace(run, records=tuple(records)), tmp_path)
    assert "1 pair labelled attentive is left out of the time won back" in page.text


def test_a_table_without_the_measurement_wins_nothing_back(tmp_path: Path) -> None:
    run = with_shares(made_up_run(seeds=2), None)
    page = page_of(run, tmp_path)
    assert "Nobody was measured to be attentive, so time won back cannot be stated." in page.text
    assert "no pair whose people were measured to be attentive" in page.text
    assert "because what people look at was not measured" in page.text
    assert "It wins back" not in page.text


def test_runs_of_attentive_people_alone_have_no_note(tmp_path: Path) -> None:
    page = page_of(made_up_run(seeds=2), tmp_path)
    assert "left out of the time won back" not in page.text
    assert "unconfirmed" not in page.text


@pytest.mark.parametrize("seeds", [1, 2])
def test_one_is_not_many_on_the_page_and_in_the_tables(
    seeds: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = made_up_run(scenarios=1, seeds=seeds, policies=("blind", "balanced"))
    lost = replace(run.records[0], success=False, time_to_goal_s=None)
    records = (lost, *run.records[1:-1], failed(run.records[-1], "SimError: no"))
    jobs = (*run.jobs, replace(run.jobs[-1], seed=99))
    page = page_of(replace(run, records=records, jobs=jobs), tmp_path)
    # Commands end in numbers, and the configuration has names and numbers, not sentences.
    texts = " ".join(text for text in page.texts if not text.strip().startswith("awarenav "))
    said, heading, _ = " ".join(texts.split()).partition("Reproduce it")
    assert heading
    assert _ONE_MANY.findall(said) == []
    assert "has not run yet" in page.text
    assert main(["compare", str(tmp_path)]) == 0
    assert _ONE_MANY.findall(capsys.readouterr().out) == []
    assert len(summarise(records).policies) == 2


def test_the_check_finds_a_wrong_plural() -> None:
    assert _ONE_MANY.search("1 episodes failed")
    assert _ONE_MANY.search("in 1 held episodes")
    assert not _ONE_MANY.search("21 episodes, 0.1 numbers")


def test_one_is_not_many_in_a_judgement() -> None:
    alone = people_by_frame(
        [{"frame": "0.png", "stamp_s": 0.0, "T_odom_camera": None, "people": []}], "made up"
    )
    assert _ONE_MANY.findall(markdown_report(judge_frames(alone, alone))) == []
