"""Targets follow the pictures exactly, and crops and halls are those in use, but held out."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from perception import Camera
from perception.networks.heads import OUTSIDE_GREY
from perception.networks.heads._crops import head_crop, looking_at
from sim_tests.dataset import RenderConfig
from sim_tests.world.hall import LAYOUTS
from training.networks import (
    Degradation,
    HeadSample,
    Recipe,
    cropped,
    rolling_shutter,
    similarity,
    warp,
)
from training.networks._augment import (
    before_background,
    box_around,
    composed,
    covered,
    moved,
    photographed_layers,
    sheared,
)
from training.networks._samples import (
    ImageSample,
    Patch,
    PersonTruth,
    layered_picture,
    outline,
    packed,
    picture,
)
from training.networks._shard_file import Shard, shard_path, write_shard


def blob(size=(120, 160), seed=0):
    """Return a mask with a bumpy outline."""
    rng = np.random.default_rng(seed)
    mask = np.zeros(size, np.uint8)
    for _ in range(5):
        centre = rng.uniform([50, 40], [110, 80]).astype(int)
        axes = rng.integers(5, 30, 2)
        cv2.ellipse(
            mask, centre.tolist(), axes.tolist(), float(rng.uniform(0, 180)), 0, 360, (1,), -1
        )
    return mask.astype(bool)


def pixel_box(mask):
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1])


@pytest.mark.parametrize("seed", range(6))
def test_the_box_of_an_outline_is_the_box_of_the_pixels_turned_and_sheared_too(seed):
    mask = blob(seed=seed)
    points = outline(mask)
    assert points.shape == (32, 2)
    np.testing.assert_array_equal(box_around(points), pixel_box(mask))
    rng = np.random.default_rng(seed)
    placed = similarity(
        np.array([80.0, 60.0]), 1.0, float(rng.normal(0.0, 0.4)), (160, 120), flip=bool(seed % 2)
    )
    matrix = composed(placed, rolling_shutter(float(rng.uniform(-0.2, 0.2)), 60.0))
    drawn = warp(np.dstack([mask.astype(np.uint8) * 255] * 3), matrix, (160, 120), 1, 0)[..., 0]
    np.testing.assert_allclose(box_around(moved(points, matrix)), pixel_box(drawn > 127), atol=1.6)


def test_a_sheared_picture_agrees_with_its_points():
    rng = np.random.default_rng(2)
    for _ in range(20):
        image = np.zeros((81, 101, 3), np.uint8)
        x, y = int(rng.integers(25, 75)), int(rng.integers(10, 70))
        image[y, x] = 255
        out, matrix = sheared(image, float(rng.uniform(-0.2, 0.2)), 40.0)
        v, u = np.nonzero(out[..., 0])
        weight = out[v, u, 0].astype(float)
        centre = np.array([(u * weight).sum(), (v * weight).sum()]) / weight.sum() + 0.5
        np.testing.assert_allclose(centre, moved(np.array([x + 0.5, y + 0.5]), matrix), atol=0.06)


def test_pngs_keep_the_picture_and_its_foreground():
    rgb = np.random.default_rng(1).integers(0, 256, (20, 30, 3), np.uint8)
    front = np.zeros((20, 30), bool)
    front[4:9, 10:22] = True
    png = packed(rgb, front)
    np.testing.assert_array_equal(picture(png), rgb)
    np.testing.assert_array_equal(layered_picture(png)[..., 3], np.where(front, 255, 0))


def test_another_background_replaces_the_scenery_and_nothing_else():
    mask = blob()
    layers = np.dstack([np.full((*mask.shape, 3), 200, np.uint8), np.where(mask, 255, 0)])
    layers = layers.astype(np.uint8)
    background = np.full((*mask.shape, 3), 7, np.uint8)
    out = before_background(layers, background, np.random.default_rng(3))
    assert (out[~mask] == 7).all()
    assert (out[mask] > 60).all()
    plain = photographed_layers(layers, Degradation(), np.random.default_rng(3), None)
    np.testing.assert_array_equal(plain, layers[..., :3])


def test_a_cover_becomes_part_of_the_foreground():
    layers = np.zeros((60, 80, 4), np.uint8)
    for seed in range(20):
        out, (x1, y1, x2, y2) = covered(
            layers, np.random.default_rng(seed), np.full((9, 9, 3), 50, np.uint8)
        )
        inside = np.zeros((60, 80), bool)
        x, y = max(round(x1), 0), max(round(y1), 0)
        inside[y : max(round(y2), 0), x : max(round(x2), 0)] = True
        np.testing.assert_array_equal(out[..., 3] == 255, inside)


def truth(rng, size=(320, 240)):
    """Return the truth about a rectangle of a person, and the picture of it, with bright dots."""
    width, height = size
    x, y = rng.uniform(60, 200), rng.uniform(20, 60)
    w, h = rng.uniform(40, 60), rng.uniform(110, 150)
    front = np.zeros((height, width), bool)
    front[int(y) : int(y + h), int(x) : int(x + w)] = True
    keypoints = np.floor(rng.uniform([x + 6, y + 6], [x + w - 6, y + h - 6], (17, 2)))
    rgb = np.full((height, width, 3), 90, np.uint8)
    rgb[front] = (20, 20, 20)
    f = 300.0
    z = 0.3 * f / w
    centre = z * np.array([*((keypoints[0] - [width / 2, height / 2]) / f), 1.0])
    person = PersonTruth(
        box_xyxy_px=box_around(outline(front)).astype(np.float32),
        keypoints_px=keypoints.astype(np.float32),
        keypoints_root_m=rng.normal(0.0, 0.3, (17, 3)).astype(np.float32),
        visible=np.ones(17, bool),
        rotation_camera_head=np.eye(3, dtype=np.float32),
        head_centre_camera_m=centre.astype(np.float32),
        head_keypoints_camera_m=rng.normal(0.0, 0.1, (5, 3)).astype(np.float32),
        head_seen=1.0,
        pixels=int(front.sum()),
        depth_m=float(z),
        outline_px=outline(front).astype(np.float32),
    )
    return person, rgb, front, f


@pytest.fixture
def shards(tmp_path):
    rng = np.random.default_rng(4)
    frames, people = [], []
    for _ in range(4):
        person, rgb, front, focal = truth(rng)
        frames.append(ImageSample(packed(rgb, front), (person,), focal))
        people.append(Patch(packed(rgb, front), (0, 0), (320, 240), (focal, 160.0, 120.0), person))
    write_shard(shard_path(tmp_path, 0), Shard(tuple(frames), tuple(people), tuple(people)))
    return tmp_path


ONLY_SHEAR = Degradation(shutter_shear=0.15)


def test_the_detector_s_boxes_are_tight_under_shear_turn_and_mirror(shards, monkeypatch):
    pytest.importorskip("torch", reason="training needs torch")
    from training.networks import _detector_data as module  # noqa: PLC0415

    monkeypatch.setattr(module, "random_degradation", lambda *args, **kwargs: ONLY_SHEAR)
    monkeypatch.setattr(module, "covered", lambda image, rng, other: (image, np.zeros(4)))
    data = module.DetectorData(shards, 0, 2)
    # White people before a black background, so that pixels tell where they are.
    for frame in data.frames:
        frame.layers[..., :3] = np.where(frame.layers[..., 3:] > 0, 255, 0)
    monkeypatch.setattr(data.backgrounds, "sometimes", lambda rng, share: None)
    judged = 0
    for seed in range(40):
        sample = data.distorted(np.random.default_rng(seed))
        if len(sample.boxes) != 1 or not sample.wanted[0]:
            continue
        bright = (sample.image > 180).all(axis=2)
        if bright.sum() < 40:
            continue
        np.testing.assert_allclose(sample.boxes[0], pixel_box(bright), atol=2.1)
        judged += 1
    assert judged > 15


@pytest.mark.parametrize("kind", ["pose", "head"])
def test_keypoints_stay_on_their_dots_under_a_camera_s_effects(shards, monkeypatch, kind):
    pytest.importorskip("torch", reason="training needs torch")
    if kind == "pose":
        from training.networks import _pose_data as module  # noqa: PLC0415

        data, size = module.PoseData(shards, 0, 2), np.array([144.0, 192.0])
        samples = data.people
    else:
        from training.networks import _head_data as module  # noqa: PLC0415

        data, size = module.HeadData(shards, 0, 2), np.array([64.0, 64.0])
        samples = data.heads
        monkeypatch.setattr(module, "_NEGATIVES", 0.0)
        monkeypatch.setattr(module, "_hide", lambda *args: None)
    effects = Degradation(shutter_shear=0.15, motion_px=3.0, motion_rad=0.4)
    monkeypatch.setattr(module, "random_degradation", lambda *args, **kwargs: effects)
    monkeypatch.setattr(module, "covered", lambda image, rng, other: (image, np.full(4, -9.0)))
    errors = []
    for sample in samples:  # one dot each, about 5 px wide, on the first keypoint
        dark = np.zeros_like(sample.image)
        dark[..., 3] = sample.image[..., 3]
        x, y = (sample.keypoints[0] - 0.5).round().astype(int).tolist()
        sample.keypoints = sample.keypoints.copy()
        sample.keypoints[0] = [x + 0.5, y + 0.5]
        cv2.circle(dark, (x, y), 2, (255, 255, 255, 255), -1)
        sample.image = dark
    monkeypatch.setattr(data.backgrounds, "sometimes", lambda rng, share: None)
    for seed in range(60):
        sample = data.distorted(np.random.default_rng(seed))
        light = sample["image"].astype(float).min(axis=2)
        light[sample["image"].std(axis=2) > 3.0] = 0.0
        light[light < 40.0] = 0.0
        if kind == "head":  # grey outside the picture is no light
            light[np.abs(light - OUTSIDE_GREY) < 3.0] = 0.0
        unit = size if kind == "head" else np.ones(2)
        place = np.stack([sample["keypoints"][k] * unit for k in range(3)])
        # A mirrored sample swaps left and right; the nose stays the first.
        if light.sum() < 300.0 or not ((place[0] > 4) & (place[0] < size - 4)).all():
            continue
        v, u = np.nonzero(light)
        weight = light[v, u]
        found = np.array([(u * weight).sum(), (v * weight).sum()]) / weight.sum() + 0.5
        errors.append(float(np.linalg.norm(found - place[0])))
    assert len(errors) > 15
    assert np.median(errors) < 0.5
    assert np.percentile(errors, 90) < 1.5


def test_batches_are_the_same_for_the_same_step(shards):
    pytest.importorskip("torch", reason="training needs torch")
    from training.networks._detector_data import DetectorData  # noqa: PLC0415
    from training.networks._head_data import HeadData  # noqa: PLC0415
    from training.networks._pose_data import PoseData  # noqa: PLC0415

    for make, rest in ((DetectorData, ()), (PoseData, ()), (HeadData, (0.2,))):
        one, two = make(shards, 3, 2), make(shards, 3, 2)
        first, again, later = one.batch(7, *rest, 4), two.batch(7, *rest, 4), one.batch(8, *rest, 4)
        for key in first:
            assert first[key].shape == again[key].shape
            assert bool((first[key] == again[key]).all()), key
        assert not bool((first["image"] == later["image"]).all())


def test_devices_that_are_not_here_are_refused():
    torch = pytest.importorskip("torch", reason="training needs torch")
    from training.networks._fit import torch_device  # noqa: PLC0415

    assert torch_device("cpu").type == "cpu"
    assert torch_device("auto").type == ("cuda" if torch.cuda.is_available() else "cpu")
    with pytest.raises(ValueError, match="must be auto, cpu, cuda or cuda:N, got 'nonsense'"):
        torch_device("nonsense")
    absent = f"cuda:{torch.cuda.device_count()}"
    with pytest.raises(ValueError, match=f"device {absent} is not here"):
        torch_device(absent)


# --- recipe and crops -----------------------------------------------------------------------------


def test_evaluation_has_its_own_halls_goods_and_colours():
    recipe = Recipe()
    held_out = recipe.held_out()
    shipped = RenderConfig()
    assert set(LAYOUTS) - set(recipe.layouts) == {"crossing", "staging_hall"}
    assert shipped.variants[1] < recipe.variants[0]
    assert recipe.variants[1] < held_out.variants[0]
    assert held_out.seed != recipe.seed


@pytest.mark.parametrize("side", [20.0, 41.3, 64.0, 97.0, 150.5])
def test_the_head_crop_in_training_equals_the_head_crop_in_use(side):
    image = np.random.default_rng(4).integers(0, 256, (240, 320, 3), np.uint8)
    centre = np.array([171.3, 118.8])
    oversampling = max(1, int(np.ceil(side / 64)))
    # Training counts from the image's corner, use from the centre of its first pixel.
    matrix = similarity(centre + 0.5, 64 / side, 0.0, (64, 64), flip=False)
    theirs = warp(image, matrix, (64, 64), oversampling)
    ours = head_crop(image, centre, side)
    # OpenCV rounds coordinates to 1/32 pixel, differently for the two crops.
    assert np.abs(theirs.astype(int) - ours.astype(int)).mean() < 3.0
    assert np.corrcoef(theirs.ravel(), ours.ravel())[0, 1] > 0.999


def test_the_crops_are_equal_off_the_axis_of_a_wide_lens_too():
    rng = np.random.default_rng(5)
    image = cv2.GaussianBlur(rng.integers(0, 256, (240, 320, 3), np.uint8), (0, 0), 1.5)
    camera = Camera.from_fov(320, 240, np.radians(110.0))
    centre = np.array([262.3, 71.8])
    head = HeadSample(
        image=image,
        centre=centre + 0.5,
        side_px=45.0,
        keypoints=np.tile(centre + 0.5, (5, 1)),
        visible=np.ones(5, bool),
        focal_px=camera.fx_px,
        principal_point=np.array([camera.cx_px, camera.cy_px]) + 0.5,
        rotation_camera_head=np.eye(3),
        seen=1.0,
    )
    sample = cropped(head, np.zeros(2), 1.0, 0.0, flip=False)
    (axes,), (stretch,) = looking_at(camera, centre[None])
    ours = head_crop(image, centre, 45.0, 64, stretch)
    assert np.abs(sample["image"].astype(int) - ours.astype(int)).mean() < 3.0
    np.testing.assert_allclose(sample["rotation"], axes.T, atol=1e-9)
    np.testing.assert_allclose(sample["keypoints"], 0.5, atol=1e-9)
    moved = cropped(head, np.array([0.1, 0.0]), 1.0, 0.0, flip=False)
    assert moved["centre"][0] == pytest.approx(0.4, abs=0.02)
