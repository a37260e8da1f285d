"""Networks trained on photographs of people detect the rendered workers, and nothing else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from genuine_detectors import MODELS, REQUIRED, GenuineDetector, iou

from sim_tests.actors.body import worker_names
from sim_tests.dataset import RenderConfig, RenderScene

CONFIG = RenderConfig(frames=72, scenes=6, people=3, seed=7)
MAX_OCCLUSION = 0.2
LEAST_SCORE = 0.25
MAX_FALSE_SHARE = 0.03


@dataclass(frozen=True)
class LabelledImage:
    image_rgb: np.ndarray
    visible_boxes: np.ndarray  # (N, 4) all people
    clear_boxes: np.ndarray  # (M, 4) people of whom less than a fifth is hidden
    looks: tuple[str, ...]


@pytest.fixture(scope="module")
def images() -> list[LabelledImage]:
    images = []
    frame = 0
    for number in range(CONFIG.scene_count):
        with RenderScene(CONFIG, number) as scene:
            while frame < CONFIG.frames and CONFIG.scene_of(frame) == number:
                image, record = scene.snapshot(frame)
                people = record["people"]
                clear = [p for p in people if p["occlusion"] < MAX_OCCLUSION]
                images.append(
                    LabelledImage(
                        image,
                        np.array([p["box_xyxy_px"] for p in people]).reshape(-1, 4),
                        np.array([p["box_xyxy_px"] for p in clear]).reshape(-1, 4),
                        tuple(p["look"] for p in clear),
                    )
                )
                frame += 1
    return images


def _network(name: str) -> object:
    """Return a network as a parameter: without its file nothing is rendered."""
    missing = not (MODELS / f"{name}.onnx").is_file()
    marks = [pytest.mark.skipif(missing, reason=f"needs {name}.onnx beside the checkout")]
    # The largest takes as long as the other two and the rendering.
    return pytest.param(name, marks=[*marks, pytest.mark.full] if "640" in name else marks)


@pytest.mark.parametrize("name", [_network(name) for name in REQUIRED])
def test_a_network_trained_on_photographs_detects_the_workers(
    name: str, images: list[LabelledImage]
) -> None:
    assert {look for image in images for look in image.looks} == set(worker_names())
    detector = GenuineDetector(name)
    found = wanted = false_frames = 0
    for image in images:
        people = detector.people(image.image_rgb, least_score=LEAST_SCORE)
        for box in image.clear_boxes:
            wanted += 1
            found += bool((iou(people.boxes_xyxy_px, box) >= 0.5).any())
        sure = people.boxes_xyxy_px[people.scores >= 0.5]
        false_frames += any(iou(image.visible_boxes, box).max(initial=0.0) < 0.5 for box in sure)
    assert wanted >= 100
    assert found / wanted >= REQUIRED[name], f"{name} finds {found} of {wanted} workers"
    assert false_frames / len(images) <= MAX_FALSE_SHARE, (
        f"{name} has false detections in {false_frames} of {len(images)} images"
    )
