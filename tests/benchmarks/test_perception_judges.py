"""Judges of perception: degraded pictures keep their truth, figures are counted right."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from paths import SHARED
from scipy.spatial.transform import Rotation

from awarenav.errors import AwarenavError
from benchmarks.perception.__main__ import main
from benchmarks.perception._degradations import HEADER, measure, meets, row_of
from benchmarks.perception._photographs import LABELS, Label, read_labels
from benchmarks.perception._photographs import measure as measure_photographs
from benchmarks.perception._pictures import CONDITIONS, degraded_picture, picture_sets, pictures
from benchmarks.perception._sureness import axis_nees, matched
from benchmarks.perception._sureness import measure as measure_sureness
from perception import HeadPose, PersonKeypoints
from sim_tests.dataset import RenderConfig
from training.networks import Recipe


@pytest.fixture(scope="module")
def shots():
    config = picture_sets(3, 5)["plain"].model_copy(update={"width_px": 320, "height_px": 240})
    return list(pictures(config))


def test_pictures_are_held_out_from_training():
    recipe = Recipe()
    for config in picture_sets(20, 0).values():
        assert isinstance(config, RenderConfig)
        assert not set(config.layouts or ()) & set(recipe.layouts)
        assert config.workers is None  # the shipped ones, which no network has seen
        assert config.variants[1] < recipe.variants[0]
    assert picture_sets(20, 0)["far"].max_range_m == 10.0
    assert picture_sets(20, 0)["wide"].horizontal_fov_deg == 110.0


@pytest.mark.parametrize("number", [0, 1])
def test_a_rolling_shutter_moves_boxes_and_keypoints_with_the_pixels(shots, number):
    condition = next(each for each in CONDITIONS if "rolling" in each.name)
    shear = condition.degradation(number).shutter_shear
    for shot in shots:
        _, record = degraded_picture(shot, condition, number, np.random.default_rng(0))
        middle = 0.5 * (shot.rgb.shape[0] - 1)
        before = {person["id"]: person for person in shot.record["people"]}
        assert {person["id"] for person in record["people"]} <= set(before)
        for person in record["people"]:
            old = before[person["id"]]
            for name, (u, v, _) in person["keypoints"].items():
                u_old, v_old, _ = old["keypoints"][name]
                assert v == pytest.approx(v_old)
                assert u == pytest.approx(u_old + shear * (v_old - middle))
            mask = shot.actors == shot.workers[person["id"]]
            rows, columns = np.nonzero(mask)
            moved = columns + shear * (rows - middle)
            inside = (moved >= 0.0) & (moved <= shot.rgb.shape[1] - 1)
            x0, y0, x1, y1 = person["box_xyxy_px"]
            assert x0 == pytest.approx(moved[inside].min(), abs=1.6)
            assert x1 == pytest.approx(moved[inside].max() + 1.0, abs=1.6)
            assert (y0, y1) == pytest.approx((rows[inside].min(), rows[inside].max() + 1), abs=1.6)


def test_another_background_keeps_every_pixel_of_people(shots):
    condition = next(each for each in CONDITIONS if each.background)
    for shot in shots:
        rgb, record = degraded_picture(shot, condition, 0, np.random.default_rng(1))
        people = shot.actors >= 0
        np.testing.assert_array_equal(rgb[people], shot.rgb[people])
        assert (rgb[~people] != shot.rgb[~people]).any(axis=1).mean() > 0.9
        assert record == shot.record


@pytest.mark.full
def test_the_shipped_networks_find_people_and_a_row_says_so():
    wanted = [each for each in CONDITIONS if each.name in ("clean", "motion blur 17 px")]
    metrics = measure(wanted, 3, 2026)
    assert list(metrics) == ["clean", "motion blur 17 px"]
    clean = metrics["clean"]["overall"]
    assert clean["recall"] >= 0.7
    assert clean["head_median_deg"] < 12.0
    assert metrics["motion blur 17 px"]["overall"]["people"] == clean["people"]
    rows = [row_of(name, each) for name, each in metrics.items()]
    assert all(row.count("|") == HEADER.splitlines()[0].count("|") for row in rows)


def test_an_unknown_condition_is_refused_with_those_there_are(capsys):
    with pytest.raises(SystemExit):
        main(["degradations", "--conditions", "fog"])
    message = capsys.readouterr().err
    assert "no condition contains fog" in message
    assert all(each.name in message for each in CONDITIONS)


def test_bounds_are_those_of_every_figure():
    good = {"head_median_deg": 6.0, "head_p90_deg": 20.0, "recall": 0.95, "false_aware": 0.005}
    assert meets({"overall": good})
    assert meets({"overall": {**good, "false_aware": None}})
    for name, worse in (
        ("head_median_deg", 6.1),
        ("head_p90_deg", 20.1),
        ("recall", 0.94),
        ("false_aware", 0.006),
        ("head_median_deg", None),
    ):
        assert not meets({"overall": {**good, name: worse}})


# --- photographs ----------------------------------------------------------------------------------


DEV = SHARED / "images" / "dev"


def test_each_box_matches_once_and_the_most_people_count():
    truth = np.array([[0.0, 0.0, 10.0, 20.0], [6.0, 0.0, 16.0, 20.0]])
    found = np.array([[3.0, 0.0, 13.0, 20.0], [0.0, 0.0, 10.0, 20.0], [50.0, 0.0, 60.0, 20.0]])
    assert matched(truth, found) == ((0, 1), (1, 0))
    assert matched(truth, np.zeros((0, 4))) == ()
    assert matched(np.zeros((0, 4)), found) == ()
    assert matched(truth[:1], found[:1], min_iou=0.6) == ()


def _label(head, box=(0.0, 0.0, 100.0, 200.0)):
    """Return a person whose nose, eyes and ears are as given: u, v and visibility of each."""
    keypoints = np.zeros((17, 3))
    keypoints[:5] = head
    keypoints[5] = (40.0, 60.0, 2.0)
    return Label(np.array(box), keypoints)


FACE = [[50, 20, 2], [56, 15, 2], [44, 15, 2], [62, 17, 2], [38, 17, 2]]


def test_labels_tell_who_looks_here_and_who_looks_away():
    assert _label(FACE).facing is True
    turned = [[57, 20, 2], *FACE[1:]]
    assert _label(turned).facing is None
    assert _label([[57, 20, 2], FACE[1], [0, 0, 0], FACE[3], [0, 0, 0]]).facing is False
    assert _label([[0, 0, 0]] * 3 + FACE[3:]).facing is False
    assert _label([[0, 0, 0]] * 5).facing is None


@given(st.floats(-40.0, 40.0), st.floats(1.0, 3.0))
def test_the_similarity_of_keypoints_falls_with_their_error_and_not_with_the_scale(off, scale):
    label = _label(FACE)
    larger = Label(scale * label.box_xyxy_px, label.keypoints_px * [scale, scale, 1.0])

    def found(of, error):
        pixels = of.keypoints_px[:, :2] + [error, 0.0]
        return PersonKeypoints(pixels, np.zeros((17, 3)), np.ones(17), "coco")

    assert label.similarity(found(label, 0.0)) == 1.0
    similarity = label.similarity(found(label, off))
    assert similarity >= label.similarity(found(label, 1.5 * off)) - 1e-12
    assert larger.similarity(found(larger, scale * off)) == pytest.approx(similarity)


def test_bad_folders_are_refused(tmp_path, capsys):
    with pytest.raises(AwarenavError, match=f"must hold photographs and {LABELS}"):
        read_labels(tmp_path)
    label = {"a.jpg": {"size": [9, 9], "people": [{"box_xyxy_px": [5, 5, 1]}]}}
    (tmp_path / LABELS).write_text(json.dumps(label), encoding="utf-8")
    with pytest.raises(AwarenavError, match=r"a\.jpg: a person must have box_xyxy_px \(4,\)"):
        read_labels(tmp_path)
    label["a.jpg"]["people"] = []
    (tmp_path / LABELS).write_text(json.dumps(label), encoding="utf-8")
    with pytest.raises(SystemExit):
        main(["photographs", str(tmp_path)])
    assert "a.jpg must be a photograph that OpenCV reads" in capsys.readouterr().err


def test_a_picture_of_noise_has_nobody(tmp_path, capsys):
    noise = np.random.default_rng(0).integers(100, 156, (120, 160, 3), np.uint8)
    cv2.imwrite(str(tmp_path / "n.png"), noise)
    person = {"box_xyxy_px": [10, 10, 50, 110], "keypoints_px": [[20, 20, 2]] * 17}
    label = {"n.png": {"size": [160, 120], "people": [person]}}
    (tmp_path / LABELS).write_text(json.dumps(label), encoding="utf-8")
    main(["photographs", str(tmp_path)])
    assert "1 people in 1 photographs: recall 0.00" in capsys.readouterr().out


@pytest.mark.full
@pytest.mark.skipif(not DEV.is_dir(), reason="the photographs of ../shared are not here")
def test_the_shipped_networks_on_photographs_are_measured_as_they_are():
    """The networks know renders: they are worse on photographs than those of the set `real`."""
    labels = read_labels(DEV)
    found = measure_photographs(DEV, labels)
    assert (found.pictures, found.people) == (28, 40)
    assert found.found > 0.4 * found.people
    assert found.false <= 0.6 * found.pictures


# --- sureness of heads ----------------------------------------------------------------------------


def _pose(rotation: np.ndarray, covariance: np.ndarray) -> HeadPose:
    full = np.eye(6) * 1e-4
    full[:3, :3] = covariance
    return HeadPose(np.array([0.0, 0.0, 3.0]), rotation, full, 0.5)


def test_errors_with_the_stated_covariance_have_a_nees_of_two():
    rng = np.random.default_rng(3)
    factor = np.array([[0.09, 0.0, 0.0], [0.03, 0.05, 0.0], [-0.02, 0.01, 0.07]])
    nees, sigmas = [], []
    for _ in range(4000):
        rotation = Rotation.random(random_state=rng).as_matrix()
        true = Rotation.from_rotvec(factor @ rng.normal(size=3)).as_matrix() @ rotation
        value, sigma = axis_nees(_pose(rotation, factor @ factor.T), true[:, 1])
        nees.append(value)
        sigmas.append(sigma)
    # The mean of 4000 values with variance 4 has a standard deviation of 0.03.
    assert np.mean(nees) == pytest.approx(2.0, abs=0.13)
    assert np.mean(np.array(nees) < 5.991) == pytest.approx(0.95, abs=0.012)
    assert 0.03 < min(sigmas) < max(sigmas) < 0.1


def test_a_turn_about_the_axis_itself_is_no_error_of_the_axis():
    rotation = Rotation.from_euler("xyz", [0.3, -1.0, 2.0]).as_matrix()
    rolled = rotation @ Rotation.from_rotvec([0.0, 0.7, 0.0]).as_matrix()
    nees, sigma = axis_nees(_pose(rotation, np.eye(3) * 0.01), rolled[:, 1])
    assert nees == pytest.approx(0.0, abs=1e-12)
    assert sigma == pytest.approx(0.1)
    turned = rotation @ Rotation.from_rotvec([0.2, 0.0, 0.0]).as_matrix()
    assert axis_nees(_pose(rotation, np.eye(3) * 0.01), turned[:, 1])[0] == pytest.approx(4.0)


@pytest.mark.full
def test_heads_of_renders_are_judged_by_condition():
    conditions = [each for each in CONDITIONS if each.name in ("clean", "5–10 m")]
    groups = measure_sureness(conditions, 3, 11)
    assert list(groups) == ["clean", "5–10 m", "faces under 20 px"]
    far, small = groups["5–10 m"], groups["faces under 20 px"]
    assert len(groups["clean"].nees) >= 2
    # All faces beyond 5 m are small.
    assert len(small.nees) >= len(far.nees) >= 2
    assert all(value > 0.0 for group in groups.values() for value in group.sigma_deg)
