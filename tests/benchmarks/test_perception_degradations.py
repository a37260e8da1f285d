"""Degraded pictures keep their truth, and the shipped networks find people in them."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.perception.__main__ import main
from benchmarks.perception._degradations import HEADER, measure, row_of
from benchmarks.perception._pictures import CONDITIONS, degraded_picture, picture_sets, pictures
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
