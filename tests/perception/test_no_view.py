"""Pictures that show nothing are told from poor ones."""

from __future__ import annotations

import math
from random import Random

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from perception.no_view import FROZEN, LastFrames, why_no_view

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
    last, picture = LastFrames(), noise()
    assert why_no_view(picture, last) is None
    again = picture.copy()
    assert why_no_view(again, last) == FROZEN
    again[-1, -1, 2] ^= 1
    assert why_no_view(again, last) is None
    assert why_no_view(picture[:240], last) is None  # of another size
    assert why_no_view(one_colour(0, 0, 0), last) == "black"
    assert why_no_view(one_colour(0, 0, 0), last) == "black"


@settings(max_examples=30)
@given(st.integers(1, 32), st.sampled_from(["u1", "<u2", "<f4", "<f8"]), st.randoms())
def test_the_buffers_of_a_frozen_driver_repeat_and_a_live_sensor_never_does(
    buffers: int, kind: str, random: Random
) -> None:
    rng, last = np.random.default_rng(random.getrandbits(32)), LastFrames()
    frames = [rng.integers(0, 255, (6, 8)).astype(kind) for _ in range(200)]
    # A still scene is live by its noise, however long it stands.
    still = [frames[0] + (frame % 2).astype(kind) for frame in frames]
    assert not any(last.repeats(frame) for frame in still)
    # From the second round on, in any order.
    frozen, first = frames[:buffers], LastFrames()
    for frame in frozen:
        first.repeats(frame)
    order = random.choices(range(buffers), k=100)
    assert all(first.repeats(frozen[index].copy()) for index in order)
    assert not first.repeats(frames[-1])


@given(
    st.floats(-math.pi, math.pi), st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(-0.1, 0.1)
)
def test_without_noise_a_frame_repeats_only_once_the_robot_has_moved(
    heading: float, x: float, y: float, turn: float
) -> None:
    def pose(x_m: float, y_m: float, yaw_rad: float) -> np.ndarray:
        T = np.eye(4)
        T[:2, :2] = [
            [math.cos(yaw_rad), -math.sin(yaw_rad)],
            [math.sin(yaw_rad), math.cos(yaw_rad)],
        ]
        T[:2, 3] = x_m, y_m
        return T

    last, (one, other), here = (
        LastFrames(),
        np.random.default_rng(0).random((2, 50)),
        pose(3, 4, heading),
    )
    assert not any(last.repeats(frame, here) for frame in (one, other, one, other))
    moved = math.hypot(x, y) > 0.05 or abs(turn) > math.radians(2.0)
    assert last.repeats(other, pose(3 + x, 4 + y, heading + turn)) is moved
    assert last.repeats(one, pose(3 + x, 4 + y, heading + turn)) is moved
    assert not last.repeats(one, here)
