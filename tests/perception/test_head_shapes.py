"""Covariance of PnP head poses over people whose heads differ from the template."""

import math

import numpy as np
import pytest
from head_shape_people import BOUND_95, CAMERA, Sample, calibrate, draw_people

from perception import PersonKeypoints, PnpHeadPoseEstimator


def people(heads, noise_px, count, seed, **where):
    rng = np.random.default_rng(seed)
    return list(draw_people(heads, noise_px, count, rng, **where))


@pytest.mark.parametrize("turned", ["all round", "profile"])
@pytest.mark.parametrize("heads", ["workers", "drawn"])
def test_the_covariance_holds_the_spread_of_head_shapes(heads, turned):
    """With 1 to 3 px of noise; heads of the workers are more alike than those of people."""
    nees = np.concatenate(
        [
            calibrate(
                people(heads, noise, 150, 10 + seed, turned=turned), PnpHeadPoseEstimator(noise)
            ).nees
            for seed, noise in enumerate((1.0, 2.0, 3.0))
        ]
    )
    assert (nees < BOUND_95).mean() >= 0.92
    assert (2.5 if heads == "drawn" else 1.8) - 0.3 <= nees.mean() <= 3.5


def test_near_heads_have_the_uncertainty_of_their_shape_not_of_their_pixels():
    samples = people("drawn", 1.0, 200, 20, range_m=(1.0, 2.0))
    exact, honest = (
        calibrate(samples, PnpHeadPoseEstimator(head_shape_spread=spread)) for spread in (0.0, 1.0)
    )
    assert exact.coverage < 0.88
    assert honest.coverage >= 0.92
    assert honest.mean <= 3.5


def test_more_spread_gives_more_uncertainty_and_far_heads_hardly_notice():
    def std_rad(samples, spread):
        poses = PnpHeadPoseEstimator(head_shape_spread=spread).estimate(
            None, CAMERA, tuple(sample.keypoints for sample in samples)
        )
        return np.median([math.sqrt(np.trace(pose.covariance[:3, :3])) for pose in poses])

    near = people("template", 1.0, 60, 21, range_m=(0.9, 1.1))
    far = people("template", 1.0, 60, 21, range_m=(4.4, 4.6))
    stds = [std_rad(near, spread) for spread in (0.0, 0.5, 1.0, 2.0)]
    assert stds == sorted(stds)
    assert stds[2] > 1.1 * stds[0]
    assert std_rad(far, 1.0) < 1.2 * std_rad(far, 0.0)


def test_three_keypoints_without_a_body_are_upright_and_uncertain():
    """A profile at the border of the image shows no shoulders."""
    samples = []
    for sample in people("drawn", 1.0, 300, 22, turned="profile", range_m=(1.0, 2.5)):
        person = sample.keypoints
        if person.scores[:5].sum() == 3:
            scores = np.where(np.arange(17) < 5, person.scores, 0.0)
            alone = PersonKeypoints(person.keypoints_px, person.keypoints_root_m, scores, "coco")
            samples.append(Sample(alone, sample.rotation_camera_head))
    found = calibrate(samples, PnpHeadPoseEstimator())
    assert len(found.nees) == len(samples) > 60
    assert found.coverage >= 0.9
