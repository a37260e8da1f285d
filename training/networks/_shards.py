"""Rendered training data: whole images, exact crops of people and of heads, with their truth.

A scene is one shard: a file that is written whole or not at all. Existing shards are not made
again. Crops are rendered at the camera's own resolution, in the rectangle of the image that they
fill, so that a crop equals that part of the whole image at a tenth of its cost.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from tqdm import tqdm

from perception.anthropometry import HEAD_CENTRE_HEAD_M, HEAD_TEMPLATE_M
from perception.layouts import LEFT_HIP, RIGHT_HIP
from perception.networks.heads import ray_axes
from sim_tests.dataset import RenderConfig
from sim_tests.world import keypoints_in_front

from ._recipe import Recipe
from ._samples import HEAD_SIDE_M, ImageSample, Patch, PersonTruth, outline, packed
from ._scenes import Person, TrainingScene
from ._shard_file import Shard, shard_path, write_shard

_BODY: Final = 17
_SIZES: Final = ((640, 480), (640, 480), (640, 480), (848, 480), (800, 600))
_FIELDS_DEG: Final = (45.0, 75.0)
# Robots also use wide lenses, which stretch people at the side. Crops of heads are cut from their
# whole resolution.
_WIDE_SHARE: Final = 0.28
_WIDE_SIZES: Final = ((800, 600), (960, 600), (1280, 800))
_WIDE_FIELDS_DEG: Final = (80.0, 120.0)
# Share of whole images without people.
_EMPTY_SHARE: Final = 0.12
_MIN_PIXELS: Final = 60
#: The greatest distance of a person.
MAX_RANGE_M: Final = 10.0
_SQUARE: Final = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 1.0, 0.0]])
#: Radius of the disk about a head in which its pixels are counted.
_HEAD_RADIUS_M: Final = 0.08


def make_shards(recipe: Recipe, workers: tuple[str, ...], folder: Path, processes: int = 2) -> None:
    """Render the scenes that are missing.

    Args:
        recipe: the amounts.
        workers: ``.npz`` files of the crowd.
        folder: folder of the shards.
        processes: processes that render.
    """
    folder.mkdir(parents=True, exist_ok=True)
    todo = [scene for scene in range(recipe.scenes) if not shard_path(folder, scene).exists()]
    context = multiprocessing.get_context("spawn")
    # PyBullet keeps the memory of a closed world; new processes give it back.
    with context.Pool(processes, maxtasksperchild=6) as pool:
        task = partial(_make_shard, recipe, workers, folder)
        for _ in tqdm(pool.imap_unordered(task, todo), total=len(todo), desc="scenes"):
            pass


def _make_shard(recipe: Recipe, workers: tuple[str, ...], folder: Path, scene: int) -> None:
    cv2.setNumThreads(1)
    rng = np.random.default_rng([recipe.seed, 11, scene])
    with TrainingScene(_config(recipe, workers, rng), scene, rng) as here:
        shard = Shard(
            tuple(_frame(here, rng) for _ in range(recipe.frames)),
            tuple(_patches(here, rng, recipe.person_patches, whole=True)),
            tuple(_patches(here, rng, recipe.head_patches, whole=False)),
        )
    write_shard(shard_path(folder, scene), shard)


def _config(recipe: Recipe, workers: tuple[str, ...], rng: np.random.Generator) -> RenderConfig:
    """Return a camera similar to that of the rendered sets, sometimes with a wide lens."""
    wide = bool(rng.random() < _WIDE_SHARE)
    sizes = _WIDE_SIZES if wide else _SIZES
    width, height = sizes[int(rng.integers(len(sizes)))]
    return RenderConfig(
        frames=10_000_000,
        scenes=recipe.scenes,
        people=4,
        width_px=width,
        height_px=height,
        horizontal_fov_deg=float(rng.uniform(*(_WIDE_FIELDS_DEG if wide else _FIELDS_DEG))),
        min_range_m=1.0,
        max_range_m=MAX_RANGE_M,
        seed=recipe.seed + 1_000_003,
        workers=workers,
        layouts=recipe.layouts,
        variants=recipe.variants,
    )


def _frame(here: TrainingScene, rng: np.random.Generator) -> ImageSample:
    """Return a whole image with its truth."""
    camera = here.hall.camera
    T_odom_camera = here.arrange(rng)
    if rng.random() < _EMPTY_SHARE:
        here.clear()
    view = here.hall.renderer.render(camera, T_odom_camera)
    people = []
    for person in here.people:
        truth = _truth(here, person, T_odom_camera, view, (0, 0))
        if truth is not None:
            people.append(truth)
    return ImageSample(packed(view.rgb, view.actors >= 0), tuple(people), camera.fx_px)


def _patches(
    here: TrainingScene, rng: np.random.Generator, wanted: int, *, whole: bool
) -> Iterator[Patch]:
    """Yield crops of people, or of heads in four poses each."""
    camera = here.hall.camera
    size = np.array([camera.width_px, camera.height_px])
    made = 0
    while made < wanted:
        T_odom_camera = here.arrange(rng)
        for person in here.people:
            for pose in range(1 if whole else 4):
                if pose:
                    here.repose(person, T_odom_camera, rng)
                box = _rectangle(camera, T_odom_camera, person, whole=whole)
                if not np.isfinite(box).all():
                    continue
                low = np.clip(np.floor(box[:2]), 0, size).astype(int)
                high = np.clip(np.ceil(box[2:]), 0, size).astype(int)
                if (high - low).min() < 6:
                    continue
                view = here.hall.renderer.render(
                    camera, T_odom_camera, [*low.tolist(), *high.tolist()]
                )
                truth = _truth(here, person, T_odom_camera, view, (int(low[0]), int(low[1])))
                if truth is None:
                    continue
                yield Patch(
                    packed(view.rgb, view.actors >= 0),
                    (int(low[0]), int(low[1])),
                    (camera.width_px, camera.height_px),
                    (camera.fx_px, camera.cx_px, camera.cy_px),
                    truth,
                )
                made += 1


def _rectangle(camera: Any, T_odom_camera: Any, worker: Person, *, whole: bool) -> Any:
    """Return the rectangle to render: the body with all surroundings that a crop may show."""
    if whole:
        pixels = camera.project(_in_camera(T_odom_camera, worker.keypoints_odom_m))
        low, high = np.nanmin(pixels, axis=0), np.nanmax(pixels, axis=0)
        pad = 0.30 * (high - low) + 0.10 * (high - low).max()
        return np.concatenate([low - pad, high + pad])
    # A square across the ray, which a wide lens draws larger than on the axis.
    centre = _head_centre(T_odom_camera, worker)
    (axes,) = ray_axes(centre[None, :2] / centre[2])
    corners = centre + 0.80 * HEAD_SIDE_M * (_SQUARE @ axes.T)
    corners[:, 2] = np.maximum(corners[:, 2], 0.1)
    pixels = camera.project(corners)
    return np.concatenate([pixels.min(axis=0), pixels.max(axis=0)])


def _truth(
    here: TrainingScene, worker: Person, T_odom_camera: Any, view: Any, origin: tuple[int, int]
) -> PersonTruth | None:
    """Return the truth in pixels of the whole image; None for a person who is not visible."""
    mask = view.actors == worker.actor
    seen = int(np.count_nonzero(mask))
    if seen < _MIN_PIXELS // 4:
        return None
    camera = here.hall.camera
    points = _in_camera(T_odom_camera, worker.keypoints_odom_m[:_BODY])
    if points[:, 2].min() < 0.2:
        return None
    pixels = camera.project(points)
    visible = keypoints_in_front(points, pixels - origin, view.depth_m)
    outermost = outline(mask) + origin
    box = np.concatenate([outermost.min(axis=0), outermost.max(axis=0)])
    rotation = T_odom_camera[:3, :3].T @ worker.rotation_odom_head
    centre = points[0] + rotation @ HEAD_CENTRE_HEAD_M
    pixel = camera.project(centre[None])[0]
    return PersonTruth(
        box_xyxy_px=box.astype(np.float32),
        keypoints_px=pixels.astype(np.float32),
        keypoints_root_m=(points - points[[LEFT_HIP, RIGHT_HIP]].mean(axis=0)).astype(np.float32),
        visible=visible,
        rotation_camera_head=rotation.astype(np.float32),
        head_centre_camera_m=centre.astype(np.float32),
        head_keypoints_camera_m=points[: len(HEAD_TEMPLATE_M)].astype(np.float32),
        head_seen=_head_seen(mask, pixel - origin, _HEAD_RADIUS_M * camera.fx_px / centre[2]),
        pixels=seen,
        depth_m=float(centre[2]),
        outline_px=outermost.astype(np.float32),
    )


def _head_seen(mask: Any, pixel: Any, radius_px: float) -> float:
    """Return the share of the disk about the head's centre that shows this person."""
    height, width = mask.shape
    v, u = np.mgrid[-1:1:9j, -1:1:9j].reshape(2, -1)
    inside = u**2 + v**2 <= 1.0
    columns = np.floor(pixel[0] + radius_px * u[inside] + 0.5).astype(int)
    rows = np.floor(pixel[1] + radius_px * v[inside] + 0.5).astype(int)
    good = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    return float(mask[rows[good], columns[good]].sum() / len(good))


def _head_centre(T_odom_camera: Any, worker: Person) -> Any:
    centre = worker.keypoints_odom_m[0] + worker.rotation_odom_head @ HEAD_CENTRE_HEAD_M
    return _in_camera(T_odom_camera, centre[None])[0]


def _in_camera(T_odom_camera: Any, points_odom_m: Any) -> Any:
    return (points_odom_m - T_odom_camera[:3, 3]) @ T_odom_camera[:3, :3]
