"""Drawings of estimates, for every kind of estimate and image."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import av
import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numbered_images import CAMERA, HEIGHT, WIDTH, numbered, standing_at

from awarenav import drawing
from awarenav.drawing import Font, awareness_colour
from awarenav.errors import AwarenavError
from awarenav.estimate import FrameEstimate, OverlayWriter, SourceFrame
from awarenav.estimate._overlay import draw_overlay, fit_image
from awarenav.overlay._places import Box, Labelled, leader, meet, place_labels
from perception import AttentionCone, Camera, PersonKeypoints, PersonObservation

CONE = AttentionCone()
GREY = numbered(10)


def observed(x_m=0.0, z_m=3.0, *, alpha=0.7, std=0.1, gaze=(0.0, 0.0, -1.0), box=None):
    if box is None:
        pixels = standing_at(x_m, max(z_m, 0.5)).keypoints_px
        box = np.concatenate([pixels.min(axis=0), pixels.max(axis=0)])
    return PersonObservation(
        stamp_s=0.0,
        position_camera_m=[x_m, 0.1, z_m],
        position_covariance_m2=0.01 * np.eye(3),
        gaze_camera=gaze,
        awareness=alpha,
        awareness_std=None if alpha is None else std,
        score=0.9,
        box_xyxy_px=box,
    )


def with_keypoints(observation, person):
    return replace(observation, keypoints=person)


def estimate(*observations, keypoints=None, image=GREY, camera=CAMERA, tracks=None):
    count = len(observations)
    return FrameEstimate(
        SourceFrame("000000", 1.25, image),
        camera,
        None,
        tuple(map(with_keypoints, observations, keypoints or (None,) * count)),
        tracks,
        (None,) * count if tracks is None else tuple(track.id for track in tracks),
    )


def test_the_overlay_is_a_new_image_and_the_old_one_is_unchanged():
    before = GREY.copy()
    drawn = draw_overlay(estimate(observed(), keypoints=(standing_at(0.0, 3.0),)), CONE)
    assert np.array_equal(GREY, before)
    assert drawn.shape == GREY.shape
    assert drawn.dtype == np.uint8
    assert np.mean((drawn != GREY).any(axis=2)) > 0.02
    # A person without a box behind the camera does no harm.
    boxless = PersonObservation(0.0, [0.0, 0.0, -2.0], np.eye(3), (0, 0, 1), None, None, 0.5, None)
    assert draw_overlay(estimate(boxless), CONE).shape == GREY.shape


def test_the_caption_names_networks_that_are_not_made_for_the_image():
    good = estimate(observed())
    unfit = replace(good, unfit=("detector",))
    wide = [
        np.flatnonzero((draw_overlay(each, CONE)[-1] != GREY[-1]).any(axis=1)).max()
        for each in (good, unfit)
    ]
    assert wide[1] > 1.5 * wide[0]


@pytest.mark.parametrize("alpha", [0.0, 0.3, 0.5, 1.0, None])
def test_the_colour_of_the_box_is_alpha(alpha):
    # Boxes count from the image's corner: this edge is drawn along the middle of row 200.
    seen = observed(alpha=alpha, gaze=None, box=np.array([100.5, 200.5, 300.5, 400.5]))
    image, camera = numbered(10, (640, 480)), Camera.from_fov(640, 480, 1.0)
    drawn = draw_overlay(estimate(seen, image=image, camera=camera), CONE).astype(int)
    assert np.abs(drawn[200, 106:116] - awareness_colour(alpha)).max() < 24
    assert np.array_equal(drawn[200, 200], image[200, 200])


def test_red_means_unaware_and_green_aware():
    red, amber, green = (np.array(awareness_colour(a)) for a in (0.0, 0.5, 1.0))
    assert red[0] > 2 * red[1]
    assert green[1] > 2 * green[0]
    assert amber[0] > amber[1] > amber[2]
    shades = np.array([awareness_colour(a) for a in np.linspace(0.0, 1.0, 101)])
    assert np.all(np.diff(shades[:, 0] - shades[:, 1]) <= 1)


def test_labels_hide_no_head_and_say_why_there_is_no_evidence():
    """Three people in a row, each under the label that the one behind had above the head."""
    image, camera = numbered(10, (640, 480)), Camera.from_fov(640, 480, 1.0)
    boxes = [np.array([250.0 + 30 * k, 60.0 + 60 * k, 350.0 + 30 * k, 470.0]) for k in range(3)]
    people = [observed(0.0, 5.0 - k, alpha=None, gaze=None, box=box) for k, box in enumerate(boxes)]
    people = [replace(each, awareness_reason="face too small") for each in people]
    drawn = draw_overlay(estimate(*people, image=image, camera=camera), CONE)
    for left, top, right, bottom in boxes:
        # Within the corners of the box; those of the others cross it.
        inner = np.s_[
            int(top) + 6 : int(top + 0.2 * (bottom - top)), int(left) + 6 : int(right) - 6
        ]
        hidden = (drawn[inner] != image[inner]).any(axis=2)
        assert hidden.mean() < 0.1
    silent = [replace(each, awareness_reason=None) for each in people]
    told = draw_overlay(estimate(*silent, image=image, camera=camera), CONE)
    assert not np.array_equal(drawn, told)


def boxes_in(picture: tuple[int, int]) -> st.SearchStrategy[Box]:
    width, height = picture
    return st.tuples(
        st.integers(0, width), st.integers(0, height), st.integers(0, width), st.integers(0, height)
    ).map(lambda b: (min(b[0], b[2]), min(b[1], b[3]), max(b[0], b[2]), max(b[1], b[3])))


PICTURE = 640, 480
labelled = st.builds(
    lambda box, share, sizes, pointer: Labelled(
        box,
        (box[0], box[1], box[2], box[1] + int(share * (box[3] - box[1]))),
        sizes,
        pointer,
    ),
    boxes_in(PICTURE),
    st.floats(0.05, 1.0),
    st.tuples(
        st.tuples(st.integers(1, 80), st.integers(1, 25)),
        st.tuples(st.integers(1, 800), st.integers(1, 500)),
    ),
    st.none() | boxes_in(PICTURE),
)


@given(people=st.lists(labelled, max_size=8), taken=st.lists(boxes_in(PICTURE), max_size=1))
def test_labels_lie_in_the_picture_and_meet_no_head_and_no_label(people, taken):
    places = place_labels(people, PICTURE, taken)
    found = [(k, place) for k, place in enumerate(places) if place is not None]
    for k, place in found:
        left, top, right, bottom = place.box
        assert 0 <= left < right <= PICTURE[0]
        assert 0 <= top < bottom <= PICTURE[1]
        assert (right - left, bottom - top) == people[k].sizes[place.size]
        for other in (*(each.head for each in people), *taken):
            assert not meet(place.box, other)
    for (_, one), (_, other) in itertools.combinations(found, 2):
        assert not meet(one.box, other.box)


@given(
    left=st.integers(0, 540),
    top=st.integers(0, 440),
    width=st.integers(5, 99),
    share=st.floats(0, 1),
)
def test_somebody_alone_has_a_whole_label_near_the_head(left, top, width, share):
    bottom = top + round(share * (480 - top))
    head = left, top, left + width, top + (bottom - top) // 5
    person = Labelled((left, top, left + width, bottom), head, ((40, 20), (120, 55)))
    (place,) = place_labels([person], PICTURE)
    assert place is not None
    assert place.size == 1
    assert math.dist(*leader(place.box, head)) <= 120


def test_a_full_row_of_people_has_whole_labels_and_a_crowd_has_small_ones():
    def row_of_people(step_px: int, count: int) -> list[Labelled]:
        sizes = ((40, 20), (110, 55))
        return [
            Labelled((k, 60, k + 60, 200), (k + 10, 60, k + 50, 90), sizes)
            for k in range(0, step_px * count, step_px)
        ]

    whole = place_labels(row_of_people(120, 5), (640, 200))
    assert [place and place.size for place in whole] == [1] * 5
    packed = place_labels(row_of_people(30, 20), (640, 200))
    assert {None if place is None else place.size for place in packed} == {0, 1}


finite = st.floats(-4.0, 4.0)


@settings(max_examples=30, deadline=None)
@given(
    x_m=finite,
    z_m=st.floats(0.05, 30.0),
    yaw=st.floats(0.0, 2.0 * math.pi),
    pitch=st.floats(-1.5, 1.5),
    alpha=st.one_of(st.none(), st.floats(0.0, 1.0)),
    std=st.floats(0.0, 2.0),
    box=st.tuples(*[st.floats(-500.0, 900.0)] * 4),
    size=st.sampled_from([(1, 1), (7, 5), (33, 31), (WIDTH, HEIGHT)]),
)
def test_any_estimate_can_be_drawn(x_m, z_m, yaw, pitch, alpha, std, box, size):
    gaze = (math.cos(pitch) * math.sin(yaw), math.sin(pitch), math.cos(pitch) * math.cos(yaw))
    low, high = np.minimum(box[:2], box[2:]), np.maximum(box[:2], box[2:])
    seen = observed(x_m, z_m, alpha=alpha, std=std, gaze=gaze, box=np.concatenate([low, high]))
    image = numbered(3, size)
    camera = Camera.from_fov(*size, 1.0)
    person = standing_at(x_m, z_m + 1.0)
    keypoints = PersonKeypoints(person.keypoints_px, person.keypoints_root_m, person.scores, "coco")
    drawn = draw_overlay(estimate(seen, keypoints=(keypoints,), image=image, camera=camera), CONE)
    assert drawn.shape == image.shape


@pytest.mark.parametrize("plain", [False, True], ids=["as installed", "OpenCV 4"])
def test_text_is_as_large_as_its_font_says(plain, monkeypatch):
    if plain:  # OpenCV 4 has no typefaces but Hershey's
        monkeypatch.setattr(drawing, "_typeface", lambda: None)
    font = Font(18)
    text = "α 0.34 ± 0.05"
    canvas = np.zeros((40, 300, 3), np.uint8)
    font.write(canvas, text, (10, 10), (255, 255, 255))
    rows, columns = np.nonzero(canvas.any(axis=2))
    assert rows.min() >= 10
    assert rows.max() < 10 + font.height_px
    assert abs((columns.max() + 1 - columns.min()) - font.width_px(text)) <= 4


@pytest.mark.parametrize(
    ("size", "target"), [((64, 48), (64, 48)), ((63, 47), (64, 48)), ((200, 50), (64, 48))]
)
def test_an_image_is_fitted_into_a_video_without_cropping(size, target):
    image = np.full((size[1], size[0], 3), 200, np.uint8)
    fitted = fit_image(image, *target)
    assert fitted.shape == (target[1], target[0], 3)
    lit = fitted[..., 0] == 200
    scale = min(target[0] / size[0], target[1] / size[1], 1.0)
    assert lit.sum() == pytest.approx(size[0] * size[1] * scale**2, rel=0.1)


def test_videos_folders_and_single_images_are_written(tmp_path):
    sizes = [(65, 49), (40, 80)]
    estimates = [estimate(image=numbered(k, size)) for k, size in enumerate(sizes)]
    with OverlayWriter(tmp_path / "new" / "a.mp4", 11.4, CONE) as video:
        for each in estimates:
            video.add(each)
    with av.open(str(tmp_path / "new" / "a.mp4")) as film:
        assert film.streams.video[0].average_rate == 11
        assert [(f.width, f.height) for f in film.decode(video=0)] == [(66, 50)] * 2
    with OverlayWriter(tmp_path / "folder", 5.0, CONE) as folder:
        folder.add(estimates[0])
    assert cv2.imread(str(tmp_path / "folder" / "000000.png")).shape == (49, 65, 3)
    with OverlayWriter(tmp_path / "a.jpg", 5.0, CONE, single=True) as single:
        single.add(estimates[0])
    assert cv2.imread(str(tmp_path / "a.jpg")).shape == (49, 65, 3)
    assert not list(tmp_path.rglob("*.part"))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("a.gif", r"must be a \.mp4 file, a folder or 'none'"),
        ("a.png", r"must be a \.mp4 file, a folder or 'none'"),
        ("file/deeper", "cannot write to"),
    ],
)
def test_other_places_are_refused(tmp_path, name, message):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(AwarenavError, match=message):
        OverlayWriter(tmp_path / name, 5.0, CONE)
