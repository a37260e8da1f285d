"""Held-out renders as real cameras would take them, each with the truth that belongs to it.

The shipped workers stand in the halls that no network was trained on. Every picture comes as
rendered, and again under one degradation at a time. Wide lenses, great distances and other
backgrounds have pictures of their own.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from awarenav.records import Record
from perception import AwarenessPipeline, Camera, HeadPoseEstimator
from perception.confirmation import KeypointConfirmation
from perception.networks import OnnxModel, OnnxPersonDetector, OnnxPoseEstimator
from perception.networks.heads import OnnxHeadPoseEstimator
from perception.shipped import DETECTOR, HEAD, POSE, detector_input_size
from sim_tests.dataset import RenderConfig, RenderScene
from sim_tests.world.camera import RenderedView
from training.networks import Degradation, Recipe, degrade, random_background, rolling_shutter

from .._harness import add_seed, count

Image = NDArray[np.uint8]

_HALLS: Final = ("crossing", "staging_hall")
_SEED: Final = 2026
_FRAMES_PER_SCENE: Final = 10
_NOISY: Final[dict[str, Any]] = {"white_e": 8000.0, "read_noise_e": 6.0}
_SHEAR: Final = 0.1
assert not set(_HALLS) & set(Recipe().layouts)


@dataclass(frozen=True)
class Condition:
    """A degradation, or pictures of their own.

    Attributes:
        name: as in the table.
        set_name: the set of pictures, a key of :func:`picture_sets`.
        degradation: of picture number n of the set.
        background: whether the scenery is replaced by a random picture.
    """

    name: str
    set_name: str = "plain"
    degradation: Callable[[int], Degradation] = lambda number: Degradation()
    background: bool = False

    @property
    def is_plain(self) -> bool:
        """True if the pictures are as rendered."""
        return not self.background and self.degradation(0) == Degradation()


def _motion(length_px: float) -> Callable[[int], Degradation]:
    # Directions half a golden angle apart cover the half circle evenly.
    turn = 0.5 * math.pi * (3.0 - math.sqrt(5.0))
    return lambda number: Degradation(motion_px=length_px, motion_rad=number * turn % math.pi)


def _always(**values: Any) -> Callable[[int], Degradation]:
    degradation = Degradation(**values)
    return lambda number: degradation


def _either(first: Degradation, second: Degradation) -> Callable[[int], Degradation]:
    return lambda number: (first, second)[number % 2]


CONDITIONS: Final = (
    Condition("clean"),
    Condition("motion blur 9 px", degradation=_motion(9.0)),
    Condition("motion blur 17 px", degradation=_motion(17.0)),
    Condition("light × 0.1, noise", degradation=_always(light=0.1, **_NOISY)),
    Condition("light × 0.1, gain × 10", degradation=_always(light=0.1, gain=10.0, **_NOISY)),
    Condition("JPEG quality 20", degradation=_always(jpeg_quality=20)),
    Condition("overexposed, +1.5 EV", degradation=_always(exposure_ev=1.5)),
    Condition("underexposed, −2 EV", degradation=_always(exposure_ev=-2.0)),
    Condition(
        "white balance warm or cold",
        degradation=_either(
            Degradation(white_balance=(1.35, 1.0, 0.65)), Degradation(white_balance=(0.7, 1.0, 1.4))
        ),
    ),
    Condition(
        "rolling shutter, 0.1 columns a row",
        degradation=_either(Degradation(shutter_shear=_SHEAR), Degradation(shutter_shear=-_SHEAR)),
    ),
    Condition("other backgrounds", background=True),
    Condition("wide lens, 110°", "wide"),
    Condition("5–10 m", "far"),
)


def picture_sets(frames: int, seed: int) -> dict[str, RenderConfig]:
    """Return the settings of the sets of pictures; 1.5 to 6 m at 60° unless their name differs."""
    common: dict[str, Any] = {
        "frames": frames,
        "scenes": math.ceil(frames / _FRAMES_PER_SCENE),
        "layouts": _HALLS,
        "min_range_m": 1.5,
        "max_range_m": 6.0,
        "seed": seed,
    }
    wide = {"width_px": 1280, "height_px": 800, "horizontal_fov_deg": 110.0}
    return {
        "plain": RenderConfig(**common),
        "wide": RenderConfig(**{**common, **wide}),
        "far": RenderConfig(**{**common, "min_range_m": 5.0, "max_range_m": 10.0}),
    }


@dataclass(frozen=True)
class Picture:
    """A rendered picture with its truth, and the actor in each pixel (H, W), −1 for scenery."""

    rgb: Image
    record: Record
    actors: NDArray[np.int32]
    workers: tuple[int, ...]


def pictures(config: RenderConfig) -> Iterator[Picture]:
    """Render the pictures of a set, one after another."""
    scene: RenderScene | None = None
    try:
        for frame in range(config.frames):
            number = config.scene_of(frame)
            if scene is None or scene.number != number:
                if scene is not None:
                    scene.close()
                scene = RenderScene(config, number)
            rgb, record = scene.snapshot(frame)
            view = _view(scene, record)
            yield Picture(rgb, record, view.actors, tuple(w.actor for w in scene.workers))
    finally:
        if scene is not None:
            scene.close()


def _view(scene: RenderScene, record: Record) -> RenderedView:
    """Return the last snapshot's view: which actor each pixel shows."""
    return scene.renderer.render(scene.camera, np.array(record["T_odom_camera"]))


def degraded_picture(
    picture: Picture, condition: Condition, number: int, rng: np.random.Generator
) -> tuple[Image, Record]:
    """Return a picture under a condition, with its truth.

    The truth's boxes are taken anew from the people's pixels where a rolling shutter moves them,
    and its keypoints are moved. Positions and directions stay: they are those of the middle row.
    """
    degradation = condition.degradation(number)
    rgb, record = picture.rgb, picture.record
    if condition.background:
        height, width = rgb.shape[:2]
        rgb = np.where(
            (picture.actors >= 0)[..., None], rgb, random_background(rng, (height, width))
        )
    if degradation.shutter_shear:
        matrix = rolling_shutter(degradation.shutter_shear, 0.5 * (rgb.shape[0] - 1))
        rgb, record = _sheared(rgb, picture, record, matrix)
    return degrade(rgb, degradation, rng), record


def _sheared(
    rgb: Image, picture: Picture, record: Record, matrix: NDArray[np.float64]
) -> tuple[Image, Record]:
    height, width = rgb.shape[:2]
    out = cv2.warpAffine(
        rgb, matrix, (width, height), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    actors = cv2.warpAffine(
        picture.actors.astype(np.float32),
        matrix,
        (width, height),
        flags=cv2.INTER_NEAREST,
        borderValue=(-1.0,),
    )
    people = []
    for person in record["people"]:
        mask = np.asarray(actors) == picture.workers[person["id"]]
        if not mask.any():
            continue
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        box = [columns[0], rows[0], columns[-1] + 1, rows[-1] + 1]
        keypoints = {
            name: [*(matrix[:, :2] @ [u, v] + matrix[:, 2]).tolist(), score]
            for name, (u, v, score) in person["keypoints"].items()
        }
        people.append({**person, "box_xyxy_px": [float(x) for x in box], "keypoints": keypoints})
    return np.asarray(out, dtype=np.uint8), {**record, "people": people}


def degraded_pictures(
    conditions: Sequence[Condition], frames: int, seed: int
) -> Iterator[tuple[Condition, Camera, int, Image, Record]]:
    """Yield condition, camera, number, picture and truth, all conditions of a picture in turn."""
    for set_name, config in picture_sets(frames, seed).items():
        wanted = [each for each in conditions if each.set_name == set_name]
        if not wanted:
            continue
        camera = config.camera
        for number, picture in enumerate(pictures(config)):
            for row, condition in enumerate(wanted):
                rng = np.random.default_rng([seed, 71, number, row])
                rgb, record = degraded_picture(picture, condition, number, rng)
                yield condition, camera, number, rgb, record


def pipeline_of(
    camera: Camera,
    folder: Path | None = None,
    head: HeadPoseEstimator | None = None,
    eye_in_head_std_rad: float | tuple[float, float] | None = None,
) -> AwarenessPipeline:
    """Return the pipeline of the shipped networks, or of those in a folder with a manifest.

    Args:
        camera: of the pictures.
        folder: networks with their manifest; None takes the shipped ones.
        head: another head pose estimator than the network.
        eye_in_head_std_rad: how far eyes wander; None takes the pipeline's default.
    """
    options: dict[str, Any] = {}
    if eye_in_head_std_rad is not None:
        options["eye_in_head_std_rad"] = eye_in_head_std_rad
    confirmation = KeypointConfirmation()
    return AwarenessPipeline(
        camera,
        OnnxPersonDetector(
            OnnxModel.shipped(DETECTOR, folder=folder),
            score_threshold=confirmation.detector_threshold,
            input_size_hw_px=detector_input_size(camera),
        ),
        OnnxPoseEstimator(OnnxModel.shipped(POSE, folder=folder)),
        OnnxHeadPoseEstimator(OnnxModel.shipped(HEAD, folder=folder)) if head is None else head,
        confirmation=confirmation,
        **options,
    )


def add_pictures(parser: argparse.ArgumentParser) -> None:
    """Add the options that choose pictures and networks."""
    parser.add_argument("--frames", type=count, default=50, help="pictures of each set")
    parser.add_argument(
        "--conditions",
        nargs="*",
        metavar="TEXT",
        help="only conditions whose names contain one of these",
    )
    add_networks(parser)
    add_seed(parser)
    parser.set_defaults(seed=_SEED)


def add_networks(parser: argparse.ArgumentParser) -> None:
    """Add the option that chooses networks."""
    parser.add_argument(
        "--networks",
        type=Path,
        metavar="DIR",
        help="folder of networks with their manifest; of photographs also a file as for "
        "`awarenav estimate --networks`",
    )


def chosen_conditions(
    parser: argparse.ArgumentParser, texts: Sequence[str] | None
) -> list[Condition]:
    """Return the conditions whose names contain one of the texts; None takes all."""
    wanted = [each for each in CONDITIONS if texts is None or any(t in each.name for t in texts)]
    if not wanted:
        names = "; ".join(each.name for each in CONDITIONS)
        parser.error(f"no condition contains {' or '.join(texts or ())}; there are {names}")
    return wanted
