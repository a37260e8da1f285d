"""Tables of episodes: what is written is read again, and what is broken is said."""

import csv

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sim_tests import SimError
from sim_tests.demo._comparison import EPISODE_COLUMNS
from sim_tests.study.measures import (
    COLUMNS,
    RECORD_COLUMNS,
    EpisodeRecord,
    read_records,
    record_row,
    write_records,
)
from sim_tests.study.measures._record import rounded

numbers = st.none() | st.floats(-1e6, 1e6).map(rounded)
texts = st.text(st.characters(exclude_categories=("C", "Zl", "Zp")), max_size=20)
KINDS = {
    "text": texts,
    "flag": st.booleans(),
    "count": st.integers(-(2**40), 2**40),
    "number": numbers,
}
cells = {name: KINDS[each.kind] for name, each in COLUMNS.items()}
cells["awareness"] = st.sampled_from(["", "aware", "unaware", "falsely_aware", "missed_aware"])
records = st.builds(EpisodeRecord, **cells)
PLAIN = EpisodeRecord("late_glance", 3, "balanced", "SamplingPlanner", "truth", success=True)
in_one_folder = settings(
    max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
@in_one_folder
@given(st.lists(records, max_size=4))
def test_a_table_gives_back_every_field(tmp_path, suffix, episodes):
    if suffix == "parquet":
        pytest.importorskip("pyarrow")
    path = tmp_path / f"episodes.{suffix}"
    write_records(path, episodes)
    assert read_records(path) == tuple(episodes)
    before = path.read_bytes()
    write_records(path, read_records(path))
    assert path.read_bytes() == before


def test_the_columns_of_earlier_tables_come_first_and_alone_suffice(tmp_path):
    assert RECORD_COLUMNS[: len(EPISODE_COLUMNS)] == EPISODE_COLUMNS
    path = tmp_path / "episodes.csv"
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(EPISODE_COLUMNS)
        writer.writerow(record_row(PLAIN)[: len(EPISODE_COLUMNS)])
    assert read_records(path) == (PLAIN,)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("scenario,seed", "scenario,speed"), "unknown column 'speed'; did you mean 'seed'"),
        (("scenario,seed", "seed,seed"), "column 'seed' 2 times"),
        (("scenario,", ""), "no column 'scenario'"),
        ((",true,", ",yes,"), "line 2: success must be true or false, got 'yes'"),
        (("glance,3,", "glance,3.5,"), "line 2: seed must be a whole number, got '3.5'"),
        (("late_glance,", "late,glance,"), "line 2 has 60 cells, its header 59"),
        (("mixed", "mixed,nan"), "cells"),
        (("scenario", "\x00\x01"), "not a table of episodes"),
    ],
)
def test_foreign_files_are_refused_by_name_and_line(tmp_path, change, message):
    path = tmp_path / "episodes.csv"
    write_records(path, [PLAIN])
    text = path.read_text()
    assert change[0] in text
    path.write_text(text.replace(*change, 1))
    with pytest.raises(SimError, match=message):
        read_records(path)


def test_absent_and_binary_files_are_said(tmp_path):
    with pytest.raises(SimError, match="cannot read the episodes"):
        read_records(tmp_path / "episodes.csv")
    picture = tmp_path / "picture.csv"
    picture.write_bytes(b"\x89PNG\n\xff\xfe\n")
    with pytest.raises(SimError, match="not a table of episodes"):
        read_records(picture)
    empty = tmp_path / "empty.csv"
    empty.write_bytes(b"")
    with pytest.raises(SimError, match="it has no column 'scenario'"):
        read_records(empty)


def test_a_write_that_fails_leaves_the_old_table(tmp_path):
    path = tmp_path / "episodes.csv"
    write_records(path, [PLAIN])

    def breaking():
        yield PLAIN
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_records(path, breaking())
    assert read_records(path) == (PLAIN,)
    with pytest.raises(SimError, match="cannot write the episodes"):
        write_records(tmp_path / "absent" / "episodes.csv", [PLAIN])
