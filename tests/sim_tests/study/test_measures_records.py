"""Tables of episodes: what is written is read again, and what is broken is said."""

import csv
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from paths import ROOT

from sim_tests import SimError
from sim_tests.study.measures import (
    COLUMNS,
    RECORD_COLUMNS,
    EpisodeRecord,
    read_records,
    record_row,
    write_records,
)
from sim_tests.study.measures._record import rounded

#: The columns of the first tables.
EPISODE_COLUMNS = (
    *("scenario", "seed", "policy", "planner", "perception", "success", "contact", "contact_by"),
    *("min_separation_m", "time_to_goal_s", "max_speed_within_2m_mps", "min_margin_m"),
    *("violation_time_s", "contacts", "duration_s"),
)
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
PLAIN = EpisodeRecord("late_glance", 3, "balanced", "ReferencePlanner", "truth", success=True)
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
        (
            ("late_glance,", "late,glance,"),
            f"2 has {len(RECORD_COLUMNS) + 1} cells, its header {len(RECORD_COLUMNS)}",
        ),
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


#: One function more in the registry; what follows reads it.
ONE_MORE = """
from sim_tests.study.measures import _metrics, path_length_m

@_metrics.measure_of_log("Half of the path", better="higher", decimals=1)
def half_path_m(log) -> "float":
    '''Half of the length that the robot drove.'''
    return 0.5 * path_length_m(log.robot_odom_m)

from measured_scenes import crossing, straight
from sim_tests.study.measures import *
from tools.docs_site.reference import metrics_page

record = measure(crossing([0.0, 0.5, 1.0], straight(1.0)))
assert record.half_path_m == 0.5
assert RECORD_COLUMNS[-1] == "half_path_m" and record_row(record)[-1] == "0.500000"
assert METRICS["half_path_m"].unit == "m"
assert summarise([record]).policies[0].means["half_path_m"].value == 0.5
assert "| `half_path_m` | Half of the path | m | higher | Half of the length" in metrics_page()
"""


@pytest.mark.slow
def test_a_new_measure_is_one_function():
    path = [str(ROOT), str(Path(__file__).parent)]
    code = f"import sys; sys.path[:0] = {path!r}\n{ONE_MORE}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
