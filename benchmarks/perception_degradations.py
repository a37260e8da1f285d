"""Perception on held-out renders under what real cameras do: ``python -m benchmarks.perception_degradations``.

The shipped workers stand in the halls that no network was trained on. Every picture is judged as
rendered, and again under one degradation at a time, with the truth that belongs to it. Wide lenses,
great distances and other backgrounds have pictures of their own. ``--networks`` judges other files
than the shipped ones, so before and after are one command each.
"""  # noqa: E501 - the command is one word

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

from awarenav.judge import judge_frames
from awarenav.records import PersonRecord, Record, read_person
from benchmarks._harness import add_seed, count, make_parser
from perception import AwarenessPipeline, Camera, PersonObservation
from perception.networks import OnnxPersonDetector, OnnxPoseEstimator
from perception.networks.heads import OnnxHeadPoseEstimator
from perception.shipped import DETECTOR, HEAD, POSE, detector_input_size, load_shipped
from sim_tests.dataset import RenderConfig, RenderScene
from sim_tests.world.camera import RenderedView
from training.networks import Degradation, Recipe, degrade, random_background, rolling_shutter

Image = NDArray[np.uint8]

#: Bounds of the figures: median and 90th percentile of the head's direction, recall, false aware.
MAX_MEDIAN_DEG: Final = 6.0
MAX_P90_DEG: Final = 20.0
MIN_RECALL: Final = 0.95
MAX_FALSE_AWARE: Final = 0.005

_HALLS: Final = ("crossing", "staging_hall")
_SEED: Final = 2026
_FRAMES_PER_SCENE: Final = 10
_NOISY: Final[dict[str, Any]] = {"white_e": 8000.0, "read_noise_e": 6.0}
_SHEAR: Final = 0.1


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
            Degradation(white_balance=(1.35, 1.0, 0.65)),
            Degradation(white_balance=(0.7, 1.0, 1.4)),
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


def pipeline_of(camera: Camera, folder: Path | None = None) -> AwarenessPipeline:
    """Return the pipeline of the shipped networks, or of those in a folder with a manifest."""
    return AwarenessPipeline(
        camera,
        OnnxPersonDetector(
            load_shipped(DETECTOR, folder=folder), input_size_hw_px=detector_input_size(camera)
        ),
        OnnxPoseEstimator(load_shipped(POSE, folder=folder)),
        OnnxHeadPoseEstimator(load_shipped(HEAD, folder=folder)),
    )


def estimated(observation: PersonObservation) -> PersonRecord:
    """Return an observation as the judge reads it."""
    gaze = observation.gaze_camera
    box = observation.box_xyxy_px
    return read_person(
        {
            "box_xyxy_px": None if box is None else box.tolist(),
            "position_camera_m": observation.position_camera_m.tolist(),
            "position_covariance_m2": observation.position_covariance_m2.tolist(),
            "gaze_camera": None if gaze is None else gaze.tolist(),
            "awareness": observation.awareness,
            "awareness_std": observation.awareness_std,
            "score": observation.score,
        },
        "an observation",
    )


def measure(
    conditions: Sequence[Condition], frames: int, seed: int, folder: Path | None = None
) -> dict[str, dict[str, Any]]:
    """Return the judge's metrics (:func:`awarenav.judge.judge_frames`) of each condition."""
    truth: dict[str, dict[str, list[PersonRecord]]] = {each.name: {} for each in conditions}
    found: dict[str, dict[str, list[PersonRecord]]] = {each.name: {} for each in conditions}
    for set_name, config in picture_sets(frames, seed).items():
        wanted = [each for each in conditions if each.set_name == set_name]
        if not wanted:
            continue
        pipeline = pipeline_of(config.camera, folder)
        for number, picture in enumerate(pictures(config)):
            for row, condition in enumerate(wanted):
                rng = np.random.default_rng([seed, 71, number, row])
                rgb, record = degraded_picture(picture, condition, number, rng)
                name = str(record["frame"])
                truth[condition.name][name] = [
                    read_person(person, name) for person in record["people"]
                ]
                found[condition.name][name] = [
                    estimated(each) for each in pipeline.process(rgb, float(number))
                ]
    return {each.name: judge_frames(truth[each.name], found[each.name]) for each in conditions}


def row_of(name: str, metrics: dict[str, Any]) -> str:
    """Return a row of the table."""
    overall, detection = metrics["overall"], metrics["detection"]

    def shown(value: float | None, unit: str, factor: float = 1.0) -> str:
        return "–" if value is None else f"{factor * value:.1f}{unit}"

    return " | ".join(
        [
            f"| {name}",
            f"{overall['found']} of {overall['people']}",
            shown(overall["recall"], " %", 100.0),
            f"{detection['false_positives_per_frame']:.2f}",
            shown(overall["head_median_deg"], "°"),
            shown(overall["head_p90_deg"], "°"),
            f"{overall['false_aware_count']} of {overall['unaware_judged']}",
            shown(overall["position_median"], " %", 100.0),
            shown(overall["awareness_within_1sigma"], " %", 100.0) + " |",
        ]
    )


HEADER: Final = (
    "| pictures | found | recall | false a picture | head median | head p90 | falsely aware "
    "| position / range | α within 1σ |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |"
)


def meets(metrics: dict[str, Any]) -> bool:
    """Return whether head direction, recall and false awareness keep their bounds."""
    overall = metrics["overall"]
    median, p90 = overall["head_median_deg"], overall["head_p90_deg"]
    recall, false_aware = overall["recall"], overall["false_aware"]
    return (
        median is not None
        and median <= MAX_MEDIAN_DEG
        and p90 <= MAX_P90_DEG
        and recall >= MIN_RECALL
        and (false_aware is None or false_aware <= MAX_FALSE_AWARE)
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a row for each condition."""
    parser = make_parser("benchmarks.perception_degradations", str(__doc__).splitlines()[0])
    parser.add_argument("--frames", type=count, default=50, help="pictures of each set")
    parser.add_argument(
        "--conditions",
        nargs="*",
        metavar="TEXT",
        help="only conditions whose names contain one of these",
    )
    parser.add_argument(
        "--networks", type=Path, metavar="DIR", help="folder of networks with their manifest"
    )
    add_seed(parser)
    parser.set_defaults(seed=_SEED)
    chosen: argparse.Namespace = parser.parse_args(arguments)
    wanted = [
        each
        for each in CONDITIONS
        if chosen.conditions is None or any(text in each.name for text in chosen.conditions)
    ]
    if not wanted:
        names = "; ".join(each.name for each in CONDITIONS)
        parser.error(f"no condition contains {' or '.join(chosen.conditions)}; there are {names}")
    recipe = Recipe()
    assert not set(_HALLS) & set(recipe.layouts)
    print(HEADER)
    failed = []
    for name, metrics in measure(wanted, chosen.frames, chosen.seed, chosen.networks).items():
        print(row_of(name, metrics), flush=True)
        if not meets(metrics):
            failed.append(name)
    print(
        f"\n{len(wanted) - len(failed)} of {len(wanted)} conditions keep head ≤ {MAX_MEDIAN_DEG:g}°"
        f" and ≤ {MAX_P90_DEG:g}° (90 %), recall ≥ {MIN_RECALL:.0%}, falsely aware "
        f"≤ {MAX_FALSE_AWARE:.1%}"
    )


if __name__ == "__main__":
    main()
