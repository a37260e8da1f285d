"""Pictures of stereo pairs, of infrared with a projector, and without colour are told."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from perception.picture_notes import picture_notes

HEIGHT, WIDTH = 480, 640


def scene(seed: int, shift_px: int = 0) -> np.ndarray:
    """Return a picture of boxes on a wall; nearer ones are shifted more, as in a second view."""
    rng = np.random.default_rng(seed)
    image = np.full((HEIGHT, WIDTH, 3), rng.integers(60, 200, 3), np.uint8)
    for nearness in np.sort(rng.uniform(0.2, 1.0, 25)):
        x, y = rng.integers(-60, WIDTH), rng.integers(-60, HEIGHT)
        w, h = (int(each) for each in rng.integers(20, 140, 2))
        x -= round(shift_px * nearness)
        colour = [int(each) for each in rng.integers(0, 256, 3)]
        cv2.rectangle(image, (int(x), int(y)), (int(x) + w, int(y) + h), colour, -1)
    noise = np.random.default_rng(seed + shift_px + 1000).normal(0.0, 2.0, image.shape)
    return np.clip(image + noise, 0, 255).astype(np.uint8)


def grey(image: np.ndarray) -> np.ndarray:
    return np.repeat(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)[..., None], 3, axis=2)


def dotted(image: np.ndarray, per_pixel: float, brightness: float) -> np.ndarray:
    rng = np.random.default_rng(3)
    dots = np.zeros(image.shape[:2], np.float32)
    for _ in range(round(per_pixel * dots.size)):
        place = int(rng.integers(image.shape[1])), int(rng.integers(image.shape[0]))
        cv2.circle(dots, place, 1, brightness * rng.uniform(0.7, 1.3), -1)
    dots = cv2.GaussianBlur(dots, (3, 3), 0)
    return np.clip(image + dots[..., None], 0, 255).astype(np.uint8)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10_000))
def test_an_ordinary_picture_is_not_noted(seed: int) -> None:
    assert picture_notes(scene(seed)) == ()
    other = np.concatenate((scene(seed), scene(seed + 1)), axis=1)
    assert picture_notes(other) == ()


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10_000), st.integers(0, 35), st.sampled_from([0, 1]), st.booleans())
def test_two_views_in_one_picture_are_told(seed, shift_px, axis, squeezed) -> None:
    """Side by side or one above the other, also squeezed to the size of one."""
    both = np.concatenate((scene(seed), scene(seed, shift_px)), axis=axis)
    if squeezed:
        both = cv2.resize(both, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
    (note,) = picture_notes(both)
    assert ("side by side" if axis == 1 else "one above the other") in note
    assert "people count twice" in note


@pytest.mark.parametrize("scale", [1, 2])
@pytest.mark.parametrize(("per_pixel", "brightness"), [(0.016, 110.0), (0.011, 90.0)])
def test_a_projector_s_dots_are_told_and_grey_alone_is_milder(scale, per_pixel, brightness) -> None:
    image = cv2.resize(grey(scene(5)), None, fx=scale, fy=scale)
    (plain,) = picture_notes(image)
    assert plain == "the picture is grey: the networks have learned from colour"
    (told,) = picture_notes(dotted(image, per_pixel, brightness))
    assert "switch the projector off" in told
