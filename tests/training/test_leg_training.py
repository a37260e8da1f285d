"""Training of the leg classifier: its gradient, its mirror, its export and its files."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import onnx
import pytest

from perception.laser import (
    CUTOUT,
    HYPOTHESIS_FEATURES,
    LaserScan,
    OnnxLegClassifier,
    RobotMotion,
    Scanner,
    scan_points,
)
from training.legs._net import export, forward, fresh_weights, gradients, mirrored
from training.legs._samples import Samples, samples_of
from training.legs._scenes import LabelledScan
from training.legs._train import Recipe, deviation_factors, joined, make_shard, read_shard, train


def labelled(ranges: np.ndarray, person: np.ndarray, place: tuple[float, float]) -> LabelledScan:
    scan = LaserScan(0.0, -1.5, 0.00625, ranges, 0.05, 20.0)
    points = scan_points(scan, Scanner.mounted(0.0, 0.0, 0.2), RobotMotion(0.0, np.eye(4)))
    return LabelledScan(points, person, np.array([place]), 0.01)


@pytest.fixture(scope="module")
def scans() -> tuple[LabelledScan, LabelledScan]:
    """Return a person on two legs beside a post, and the same in a mirror."""
    angles = -1.5 + 0.00625 * np.arange(481)
    ranges = np.full(481, 5.0)
    person = np.full(481, -1)
    for x, y, radius, who in ((2.0, 0.6, 0.06, 0), (2.1, 0.35, 0.06, 0), (3.0, -0.5, 0.08, -1)):
        away, off = math.hypot(x, y), np.angle(np.exp(1j * (angles - math.atan2(y, x))))
        inside = (away * np.sin(off)) ** 2 < radius**2
        ranges[inside] = (
            away * np.cos(off) - np.sqrt(radius**2 - (away * np.sin(off)) ** 2 * inside)
        )[inside]
        person[inside] = who
    place = (2.05, 0.475)
    return (
        labelled(ranges, person, place),
        labelled(ranges[::-1], person[::-1], (place[0], -place[1])),
    )


def random_samples(rng: np.random.Generator, count: int) -> Samples:
    features = rng.normal(size=(count, HYPOTHESIS_FEATURES)).astype(np.float32)
    person = (features[:, 0] > 0.0).astype(float)
    return Samples(features, person, person[:, None] * rng.normal(size=(count, 2)))


def test_the_gradient_is_that_of_the_loss() -> None:
    rng = np.random.default_rng(0)
    samples = random_samples(rng, 40)
    weights = fresh_weights(samples, rng)
    arguments = samples.features.astype(float), samples.person, samples.offset_m
    _, found = gradients(weights, *arguments)
    for name, gradient in found.items():
        for _ in range(4):
            entry = tuple(int(rng.integers(extent)) for extent in gradient.shape)
            losses = []
            for step in (1e-6, -1e-6):
                moved = {**weights, name: weights[name].copy()}
                moved[name][entry] += step
                losses.append(gradients(moved, *arguments)[0])
            slope = (losses[0] - losses[1]) / 2e-6
            assert slope == pytest.approx(gradient[entry], rel=1e-4, abs=1e-7)


def test_labels_follow_the_rays(scans) -> None:
    samples = samples_of([scans[0]])
    pairs = samples.features[:, 22] > 0.5
    assert samples.person[pairs].sum() == 1.0
    assert samples.person[~pairs].sum() == 2.0
    (offset,) = samples.offset_m[pairs & (samples.person > 0.5)]
    # The rays meet the near sides of the legs.
    np.testing.assert_allclose(offset, [0.045, 0.0], atol=0.02)


def test_mirrored_samples_are_those_of_the_mirrored_scan(scans) -> None:
    home, mirror = (samples_of([scan]) for scan in scans)
    features, offset = mirrored(home.features, home.offset_m)
    assert len(mirror.features) == len(features)
    for row in range(len(features)):
        away = np.abs(mirror.features[:, :-CUTOUT] - features[row, :-CUTOUT]).max(axis=1)
        twin = int(away.argmin())
        assert away[twin] < 0.01
        assert mirror.person[twin] == home.person[row]
        np.testing.assert_allclose(mirror.offset_m[twin], offset[row], atol=1e-6)
        # A sample midway between two rays may fall on either.
        assert (np.abs(mirror.features[twin] - features[row]) < 0.01).mean() > 0.93
    again, _ = mirrored(*mirrored(home.features, home.offset_m))
    np.testing.assert_array_equal(again, home.features)


def test_the_exported_network_says_what_was_trained(tmp_path) -> None:
    rng = np.random.default_rng(1)
    samples = random_samples(rng, 60)
    weights = fresh_weights(samples, rng)
    factors = np.array([1.5, 2.0])
    export(weights, factors, tmp_path / "net.onnx")
    onnx.checker.check_model(onnx.load(tmp_path / "net.onnx"))
    judged = OnnxLegClassifier(tmp_path / "net.onnx")(samples.features)
    out, _ = forward(weights, samples.features.astype(float))
    np.testing.assert_allclose(judged[:, 0], 1.0 / (1.0 + np.exp(-out[:, 0])), atol=1e-5)
    np.testing.assert_allclose(judged[:, 1:3], out[:, 1:3], atol=1e-4)
    deviations = np.exp(np.clip(out[:, 3:], -4.5, -0.5)) * factors
    np.testing.assert_allclose(judged[:, 3:], deviations, rtol=1e-4)


def test_training_goes_on_where_it_was_stopped(tmp_path) -> None:
    samples = random_samples(np.random.default_rng(2), 400)
    recipe = replace(Recipe(), steps=60, batch=32, checkpoint=20)
    for name in ("whole", "parts"):
        (tmp_path / name).mkdir()
    whole = train(recipe, samples, samples, tmp_path / "whole")
    # The rate follows the number of all steps, so a stop is a copy of an early checkpoint.
    stopped = replace(recipe, checkpoint=40)
    with pytest.raises(KeyboardInterrupt):
        _train_until(stopped, samples, tmp_path / "parts", 50)
    parts = train(recipe, samples, samples, tmp_path / "parts")
    for name, value in whole.items():
        np.testing.assert_array_equal(parts[name], value)
    loss, _ = gradients(whole, samples.features.astype(float), samples.person, samples.offset_m)
    fresh = fresh_weights(samples, np.random.default_rng(recipe.seed))
    begun, _ = gradients(fresh, samples.features.astype(float), samples.person, samples.offset_m)
    assert loss < 0.9 * begun
    assert (deviation_factors(whole, samples) >= 1.0).all()


def _train_until(recipe: Recipe, samples: Samples, folder, steps: int) -> None:
    """Train, and interrupt the training after some steps."""
    import training.legs._train as trainer  # noqa: PLC0415

    calls = iter(range(steps))

    def counted(*arguments):
        if next(calls, None) is None:
            raise KeyboardInterrupt
        return gradients(*arguments)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trainer, "gradients", counted)
        trainer.train(recipe, samples, samples, folder)


def test_a_hall_of_scans_is_made_once_and_read_as_it_was_made(tmp_path) -> None:
    recipe = replace(Recipe().quick(), people=2)
    path = make_shard(recipe, tmp_path, 1, check=False)
    written = path.stat().st_mtime_ns
    assert make_shard(recipe, tmp_path, 1, check=False).stat().st_mtime_ns == written
    samples = joined([read_shard(path)])
    assert samples.features.shape == (len(samples.person), HYPOTHESIS_FEATURES)
    assert 0 < samples.person.sum() < len(samples.person)
    assert np.abs(samples.offset_m).max() < 0.8
    (tmp_path / "again").mkdir()
    again = read_shard(make_shard(recipe, tmp_path / "again", 1, check=False))
    np.testing.assert_array_equal(again.features, samples.features)
