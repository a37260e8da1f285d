"""Pictures that show nothing are told from poor ones."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from perception.no_view import FROZEN, why_no_view

SIZE = (480, 640, 3)


def noise(seed: int = 0, mean: float = 120.0, std: float = 30.0) -> np.ndarray:
    values = np.random.default_rng(seed).normal(mean, std, SIZE)
    return np.clip(values, 0, 255).astype(np.uint8)


def one_colour(*rgb: int) -> np.ndarray:
    return np.full(SIZE, rgb, np.uint8)


def night_with_noise() -> np.ndarray:
    """Return a dark yard with a lit window far away, as a sensor with noise shows it."""
    image = noise(mean=6.0, std=3.0).astype(float)
    image[200:224, 301:313] += 30.0
    return np.clip(image, 0, 255).astype(np.uint8)


def with_hot_pixels(image: np.ndarray) -> np.ndarray:
    image[[7, 105, 400], [9, 15, 600]] = 255
    return image


@pytest.mark.parametrize(
    ("image", "reason"),
    [
        (one_colour(0, 0, 0), "black"),
        (with_hot_pixels(one_colour(0, 0, 0)), "black"),
        (noise(mean=1.0, std=1.0), "black"),  # a cap on the lens
        (one_colour(255, 255, 255), "of one colour"),
        (one_colour(0, 0, 255), "of one colour"),  # the blue of a receiver without a signal
        (with_hot_pixels(one_colour(90, 90, 90)), "of one colour"),
        (np.zeros((1, 1, 3), np.uint8), "black"),
        (noise(), None),
        (night_with_noise(), None),
        (noise(mean=6.0, std=3.0), "black"),  # a covered sensor with its gain at the highest
        (noise(mean=11.0, std=4.0), "of one colour"),
        (noise(mean=118.0, std=3.0), "of one colour"),  # a cloth over the lens
    ],
)
def test_a_picture_of_a_covered_or_dead_camera_is_no_view(image, reason) -> None:
    assert why_no_view(image) == reason


@pytest.mark.parametrize("suffix", [".jpg", ".webp", ".png"])
def test_a_codec_does_not_make_one_colour_a_view(suffix: str) -> None:
    for rgb in ((20, 90, 200), (0, 0, 0), (251, 3, 140)):
        coded = cv2.imencode(suffix, one_colour(*rgb))[1]
        assert why_no_view(cv2.imdecode(coded, cv2.IMREAD_COLOR)) is not None


def test_somebody_small_or_lit_in_the_dark_is_a_view() -> None:
    dark, grey = one_colour(0, 0, 0), one_colour(90, 90, 90)
    dark[200:224, 301:307] = 40
    grey[203:222, 303:306] = 70
    assert why_no_view(dark) is None
    assert why_no_view(grey) is None


def test_the_same_picture_again_is_no_view_and_one_other_bit_makes_it_one() -> None:
    picture = noise()
    again = picture.copy()
    assert why_no_view(again, picture) == FROZEN
    again[-1, -1, 2] ^= 1
    assert why_no_view(again, picture) is None
    assert why_no_view(picture[:240], picture) is None  # of another size
    assert why_no_view(one_colour(0, 0, 0), one_colour(0, 0, 0)) == "black"
