"""The truth beside tracks: who each of them was, instant by instant."""

from __future__ import annotations

import math

import numpy as np
import pytest
from track_lines import lines, recorded, standing, walking

from awarenav.errors import AwarenavError
from awarenav.tracks._tracking import tracks_in_file
from awarenav.tracks._truth import match_truth, person_ids_text, true_people

PEOPLE = [walking(4.0, -2.0, 0.0, 1.0), standing(5.0, 1.0), walking(7.0, 3.0, -0.5, 0.0)]


def test_the_truth_is_where_people_are_and_how_aware(tmp_path):
    records = lines(PEOPLE, named=True, awareness=lambda t: 0.25 * t)
    people = true_people(recorded(tmp_path, records))
    assert [person.id for person in people] == [0, 1, 2]
    for person, place in zip(people, PEOPLE, strict=True):
        expected = [place(stamp_s) for stamp_s in person.stamps_s]
        np.testing.assert_allclose(person.positions_odom_m, expected, atol=1e-9)
        np.testing.assert_allclose(person.awareness, 0.25 * person.stamps_s)


def test_every_track_is_the_person_that_it_follows(tmp_path):
    truth = recorded(tmp_path, lines(PEOPLE, named=True))
    matches = match_truth(tracks_in_file(truth).histories, true_people(truth))
    for id, matched in matches.items():
        assert {person for _, person, _ in matched} == {id}
        assert len(matched) == 40
        assert person_ids_text(matched) == str(id)


def test_a_track_that_changes_to_another_person_matches_both(tmp_path):
    truth = recorded(tmp_path, lines(PEOPLE, named=True))
    records = lines(PEOPLE, named=True)
    for record in records[30:]:
        first, second = record["people"][:2]
        first["id"], second["id"] = second["id"], first["id"]
    run = tracks_in_file(recorded(tmp_path, records, "switched.jsonl"))
    matches = match_truth(run.histories, true_people(truth))
    assert [person for _, person, _ in matches[0]] == [0] * 30 + [1] * 10
    assert person_ids_text(matches[0]) == "0, 1"
    assert person_ids_text(matches[1]) == "1, 0"


@pytest.mark.parametrize(
    ("places", "late_s", "counts"),
    [
        ([standing(4.0, 0.99)], 0.0, [4]),
        ([standing(4.0, 1.01)], 0.0, [0]),
        # A far track does not take a near one's person.
        ([standing(4.0, 0.1), standing(40.0, 0.0)], 0.0, [4, 0]),
        ([standing(4.0, 0.0)], 0.02, [4]),
        ([standing(4.0, 0.0)], 0.05, [0]),
    ],
)
def test_a_track_matches_somebody_near_at_its_instant(tmp_path, places, late_s, counts):
    unknown = lines([standing(4.0, 0.0)], frames=4, named=True, awareness=lambda t: None)
    truth = true_people(recorded(tmp_path, unknown))
    records = lines(places, frames=4, named=True)
    for record in records:
        record["stamp_s"] += late_s
    run = tracks_in_file(recorded(tmp_path, records, "tracks.jsonl"))
    matches = match_truth(run.histories, truth)
    assert [len(matches[k]) for k in range(len(places))] == counts
    assert all(math.isnan(alpha) for rows in matches.values() for _, _, alpha in rows)
    assert person_ids_text([]) == "–"


def test_a_truth_without_ids_is_refused(tmp_path):
    with pytest.raises(AwarenavError, match="need an id"):
        true_people(recorded(tmp_path, lines(PEOPLE)))
