"""Networks trained on photographs of people find the rendered workers, and nobody else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from genuine_detectors import MODELS, REQUIRED, GenuineDetector, iou

from sim_tests.actors.body import worker_names
from sim_tests.dataset import RenderConfig, RenderScene

CONFIG = RenderConfig(frames=72, scenes=12, people=3, seed=7)
MAX_OCCLUSION = 0.2
LEAST_SCORE = 0.25
MAX_FALSE_SHARE = 0.03


@dataclass(frozen=True)
class Picture:
    image_rgb: np.ndarray
    everyone: np.ndarray  # (N, 4) boxes of all who show
    clear: np.ndarray  # (M, 4) boxes of those at most a fifth hidden
    looks: tuple[str, ...]


@pytest.fixture(scope="module")
def pictures() -> list[Picture]:
    taken = []
    frame = 0
    for number in range(CONFIG.scene_count):
        with RenderScene(CONFIG, number) as scene:
            while frame < CONFIG.frames and CONFIG.scene_of(frame) == number:
                image, record = scene.snapshot(frame)
                people = record["people"]
                clear = [p for p in people if p["occlusion"] < MAX_OCCLUSION]
                taken.append(
                    Picture(
                        image,
                        np.array([p["box_xyxy_px"] for p in people]).reshape(-1, 4),
                        np.array([p["box_xyxy_px"] for p in clear]).reshape(-1, 4),
                        tuple(p["look"] for p in clear),
                    )
                )
                frame += 1
    return taken


@pytest.mark.parametrize("name", REQUIRED)
def test_a_network_that_never_saw_a_render_finds_the_workers(
    name: str, pictures: list[Picture]
) -> None:
    if not (MODELS / f"{name}.onnx").is_file():
        pytest.skip(f"needs {name}.onnx in the folder of genuine models")
    detector = GenuineDetector(name)
    found = wanted = false_frames = 0
    for picture in pictures:
        people = detector.people(picture.image_rgb, least_score=LEAST_SCORE)
        for box in picture.clear:
            wanted += 1
            found += bool((iou(people.boxes_xyxy_px, box) >= 0.5).any())
        sure = people.boxes_xyxy_px[people.scores >= 0.5]
        false_frames += any(iou(picture.everyone, box).max(initial=0.0) < 0.5 for box in sure)
    assert wanted >= 100
    assert found / wanted >= REQUIRED[name], f"{name} finds {found} of {wanted} workers"
    assert false_frames / len(pictures) <= MAX_FALSE_SHARE, (
        f"{name} sees people who are not there in {false_frames} of {len(pictures)} pictures"
    )


def test_every_worker_is_among_them(pictures: list[Picture]) -> None:
    seen = {look for picture in pictures for look in picture.looks}
    assert seen == set(worker_names())
