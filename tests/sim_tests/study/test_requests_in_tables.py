"""Requests for attention in the tables, the report and compare: sums, and only where asked."""

import json
from dataclasses import replace

import pytest
from page_reader import PageReader
from report_runs import made_up_run

from awarenav.cli import main
from sim_tests.study.measures import EpisodeRecord, summarise, summary_text, write_records
from sim_tests.study.report import write_report

HEADING = "Requests for attention"
SECTION = "Requests per hour"
NOTE = "Simulated people answer a request that they hear with probability"


def episode(seed, policy, duration_s, *counts):
    names = ("requests", "requests_answered", "requests_needless", "asked_twice")
    values = dict(zip(names, counts, strict=False))
    return EpisodeRecord(
        "late_glance", seed, policy, "Q", "truth", True, duration_s=duration_s, **values
    )


ASKED = [
    episode(0, "balanced", 10.0, 4, 1, 2, 1),
    episode(1, "balanced", 30.0, 0, 0, 0, 0),
    episode(2, "balanced", 50.0, 1, 1, 0, 0),
]
BLIND = [episode(seed, "blind", 20.0) for seed in range(3)]


def row_of(records, policy="balanced"):
    return next(row for row in summarise(records).policies if row.variant == policy)


def test_rates_and_shares_are_ratios_of_sums():
    row = row_of([*ASKED, *BLIND])
    values = {name: row.means[name].value for name in row.means}
    assert values["requests"] == pytest.approx(5 / 3)
    assert values["requests_per_hour"] == pytest.approx(5 * 3600 / 90)
    assert values["answered_share"] == pytest.approx(2 / 5)  # not the mean of 1/4 and 1
    assert values["needless_share"] == pytest.approx(2 / 5)
    assert values["asked_twice"] == pytest.approx(1 / 3)
    assert row.asked
    blind = row_of([*ASKED, *BLIND], "blind")
    assert not blind.asked
    assert blind.means["requests_per_hour"].value == 0.0
    assert not blind.means["answered_share"].known


def test_an_episode_without_a_duration_or_with_an_error_is_in_no_rate():
    broken = replace(ASKED[0], seed=7, error="it broke", requests=0)
    unknown = replace(ASKED[0], seed=8, duration_s=None)
    row = row_of([*ASKED, broken, unknown])
    assert row.means["requests_per_hour"].value == pytest.approx(5 * 3600 / 90)
    assert row.means["answered_share"].value == pytest.approx(3 / 9)


def test_requests_have_a_table_of_those_who_asked_and_of_nobody_else():
    text = summary_text(summarise([*ASKED, *BLIND]))
    table = text.partition(HEADING)[2].partition("\n\n")[2].partition("\n\n")[0]
    assert "1.67 [" in table
    assert "200.0 [" in table
    assert table.count("40 [") == 2
    assert "blind" not in table
    silent = [replace(r, requests=0, requests_answered=0, requests_needless=0) for r in ASKED]
    assert HEADING not in summary_text(summarise([*silent, *BLIND]))


def test_requests_change_no_other_figure():
    silent = [episode(r.seed, r.policy, r.duration_s) for r in ASKED]
    with_requests, without = (summary_text(summarise([*r, *BLIND])) for r in (ASKED, silent))
    kept = [block for block in with_requests.split("\n\n") if block in without.split("\n\n")]
    assert kept == without.split("\n\n")


def test_a_request_after_an_answer_is_said():
    said = "balanced: 1 request to people who had answered; there should be none"
    assert said not in summary_text(summarise(ASKED))
    again = [replace(ASKED[0], requests_after_answer=1), *ASKED[1:]]
    assert said in summary_text(summarise(again))


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({}, f"{NOTE} 0.5 (the default"),
        ({"population": "recorded"}, f"{NOTE} 0.5 (the default"),
        ({"population": "answers=0.3"}, f"{NOTE} 0.3 (population answers=0.3)"),
        (
            {"population": "recorded,startles=0.2,answers=0.8"},
            f"{NOTE} 0.8 (population recorded,startles=0.2,answers=0.8)",
        ),
    ],
)
def test_compare_and_report_say_what_share_of_people_answers(tmp_path, capsys, settings, said):
    run = made_up_run(scenarios=2, seeds=2)
    asking = [replace(r, requests=1) if r.policy == "balanced" else r for r in run.records]
    about = {**run.run, "settings": {**run.run["settings"], **settings}}
    folder = replace(run, records=tuple(asking), run=about).write(tmp_path / "run")
    assert main(["compare", str(folder)]) == 0
    assert said in capsys.readouterr().out
    page = PageReader(write_report(folder, stills=False).read_text("utf-8"))
    assert said in page.text
    assert "requests" in page.ids


def test_nothing_is_said_of_answers_where_nobody_was_asked(tmp_path, capsys):
    folder = made_up_run(scenarios=2, seeds=2).write(tmp_path / "run")
    assert main(["compare", str(folder)]) == 0
    text = capsys.readouterr().out
    assert NOTE not in text
    assert HEADING not in text
    page = PageReader(write_report(folder, stills=False).read_text("utf-8"))
    assert NOTE not in page.text
    assert SECTION not in page.text


def test_a_table_alone_says_nothing_of_its_people(tmp_path, capsys):
    path = tmp_path / "episodes.csv"
    write_records(path, ASKED)
    assert main(["compare", str(path)]) == 0
    text = capsys.readouterr().out
    assert HEADING in text
    assert NOTE not in text
    (tmp_path / "run.json").write_text(json.dumps([1]))  # damaged
    assert main(["compare", str(tmp_path)]) == 0
    assert NOTE not in capsys.readouterr().out


def test_the_default_share_is_that_of_the_simulated_people():
    hearing = pytest.importorskip("sim_tests.actors.behaviour._hearing")
    from sim_tests.study.measures._compare import DEFAULT_ANSWERS  # noqa: PLC0415

    assert hearing.Hearing().answers == DEFAULT_ANSWERS
