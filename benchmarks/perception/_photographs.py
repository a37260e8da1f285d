"""People, keypoints and awareness on labelled photographs.

The folder holds photographs and ``coco_labels.json``: for each file its size (width, height) and
the people in it, each with ``box_xyxy_px`` and COCO's 17 ``keypoints_px`` (u, v and visibility 0, 1
or 2). People who are smaller than a fifth of the picture's height count neither as missed nor as
false. Whether a face looks here follows from its labels: the nose lies between two visible eyes. It
looks away if neither nose nor eyes are labelled as visible, or one eye alone beside one ear. The
rest may be either.

Source of the similarity of keypoints (OKS): cocodataset.org, "Keypoint Evaluation".
"""

from __future__ import annotations

import argparse
import json
import math
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from awarenav.errors import AwarenavError
from perception import AwarenessPipeline, Camera, PersonKeypoints
from perception import layouts as kp
from perception.named import NetworkChoice
from perception.networks import OnnxSettings

from ._pictures import add_networks, pipeline_of
from ._sureness import matched

AWARE: Final = 0.5
LABELS: Final = "coco_labels.json"
# COCO's constants of the keypoints, and the share of a box that a body covers.
_SIGMAS: Final = 1e-3 * np.array(
    [26, 25, 25, 35, 35, 79, 79, 72, 72, 62, 62, 107, 107, 87, 87, 89, 89]
)
_BODY_SHARE: Final = 0.53
_SMALLEST_SHARE: Final = 0.2
_MIN_IOU: Final = 0.5
# The nose of a face that looks here, from one eye to the other.
_BETWEEN: Final = (0.25, 0.75)


@dataclass(frozen=True)
class Label:
    """A person of a photograph: box (4,), and keypoints (17, 3) with their visibility."""

    box_xyxy_px: NDArray[np.float64]
    keypoints_px: NDArray[np.float64]

    @property
    def facing(self) -> bool | None:
        """True for a face that looks about here, False for one that does not, else None."""
        head = self.keypoints_px[kp.HEAD]
        seen = head[:, 2] == 2
        if seen[:3].all():
            nose, left, right = head[:3, :2]
            across = left - right
            share = float((nose - right) @ across) / max(float(across @ across), 1e-9)
            return True if _BETWEEN[0] <= share <= _BETWEEN[1] else None
        one_side = bool(seen[1:3].sum() == 1 and seen[3:].sum() == 1)
        return False if one_side or (not seen[:3].any() and seen[3:].any()) else None

    def similarity(self, person: PersonKeypoints) -> float | None:
        """Return the OKS of estimated keypoints; None without a labelled one."""
        labelled = self.keypoints_px[:, 2] > 0
        if not labelled.any():
            return None
        width, height = (self.box_xyxy_px[2:] - self.box_xyxy_px[:2]).tolist()
        away = ((person.keypoints_px[kp.BODY] - self.keypoints_px[:, :2]) ** 2).sum(axis=1)
        errors = away / (2.0 * (2.0 * _SIGMAS) ** 2 * _BODY_SHARE * width * height)
        return float(np.exp(-errors)[labelled].mean())


#: The people of every photograph, by the name of its file.
Labels = dict[str, list[Label]]


@dataclass
class Figures:
    """Counts over photographs."""

    pictures: int = 0
    people: int = 0
    found: int = 0
    false: int = 0
    similarities: list[float] = field(default_factory=list)
    #: α of faces that look here, and of people who look away; None without evidence.
    facing: list[float | None] = field(default_factory=list)
    away: list[float | None] = field(default_factory=list)
    processor_ms: list[float] = field(default_factory=list)

    def __str__(self) -> str:
        facing = [each for each in self.facing if each is not None]
        away = [each for each in self.away if each is not None]
        return "\n".join(
            (
                f"{self.people} people in {self.pictures} photographs: recall "
                f"{_share(self.found, self.people)}, false boxes a picture "
                f"{_share(self.false, self.pictures)}",
                f"keypoints of {len(self.similarities)} skeletons: OKS "
                f"{_share(math.fsum(self.similarities), len(self.similarities))}",
                f"faces that look here: {sum(each >= AWARE for each in facing)} aware of "
                f"{len(facing)} with an α, of {len(self.facing)} found",
                f"people who look away: {sum(each >= AWARE for each in away)} aware of "
                f"{len(away)} with an α, of {len(self.away)} found",
                f"processor time a picture: {np.median(self.processor_ms):.0f} ms (median)",
            )
        )


def read_labels(folder: Path) -> Labels:
    """Return the people in every labelled photograph of a folder.

    Raises:
        AwarenavError: for a folder without labels, and for labels of another form.
    """
    path = folder / LABELS
    if not path.is_file():
        raise AwarenavError(f"{folder} must hold photographs and {LABELS}, which is missing")
    labels: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return {
        name: [_label(each, name) for each in label["people"]]
        for name, label in sorted(labels.items())
    }


def _label(person: dict[str, Any], name: str) -> Label:
    box = np.asarray(person.get("box_xyxy_px"), dtype=np.float64)
    keypoints = np.asarray(person.get("keypoints_px"), dtype=np.float64)
    if box.shape != (4,) or keypoints.shape != (17, 3):
        raise AwarenavError(
            f"{name}: a person must have box_xyxy_px (4,) and keypoints_px (17, 3), got "
            f"{box.shape} and {keypoints.shape}"
        )
    return Label(box, keypoints)


def measure(
    folder: Path, labels: Labels, networks: Path | None = None, fov_rad: float = math.radians(60.0)
) -> Figures:
    """Run the pipeline on the photographs of a folder and compare it with the labels.

    Args:
        folder: the photographs.
        labels: of :func:`read_labels`.
        networks: a file for ``--networks`` of ``awarenav estimate``, or a folder of networks with a
            manifest; None takes the shipped ones.
        fov_rad: horizontal field of view that is assumed of the longer side.
    """
    figures = Figures()
    chosen = None
    if networks is None or not networks.is_dir():
        choice = NetworkChoice() if networks is None else NetworkChoice.from_yaml(networks)
        chosen = choice.load(settings=OnnxSettings(intra_op_threads=1))
    for name, people in labels.items():
        rgb = read_rgb(folder / name)
        height, width = rgb.shape[:2]
        # The field of view belongs to the longer side, also of an upright photograph.
        focal = 0.5 * max(height, width) / math.tan(0.5 * fov_rad)
        camera = Camera(width, height, focal, focal, 0.5 * width, 0.5 * height)
        pipeline = (
            pipeline_of(camera, networks)
            if chosen is None
            else AwarenessPipeline.of(chosen, camera)
        )
        _count(figures, pipeline, rgb, people)
    return figures


def _count(
    figures: Figures, pipeline: AwarenessPipeline, rgb: NDArray[np.uint8], people: list[Label]
) -> None:
    """Add one photograph to the figures."""
    began = time.process_time()
    observations = pipeline.process(rgb, 0.0)
    figures.processor_ms.append(1e3 * (time.process_time() - began))
    boxes = np.array([each.box_xyxy_px for each in observations]).reshape(-1, 4)
    truth = np.array([each.box_xyxy_px for each in people]).reshape(-1, 4)
    partner = dict(matched(truth, boxes, _MIN_IOU))
    smallest_px = _SMALLEST_SHARE * rgb.shape[0]
    figures.pictures += 1
    figures.false += sum(
        row not in partner.values() and box[3] - box[1] >= smallest_px
        for row, box in enumerate(boxes)
    )
    for row, label in enumerate(people):
        if label.box_xyxy_px[3] - label.box_xyxy_px[1] < smallest_px:
            continue
        figures.people += 1
        if row not in partner:
            continue
        figures.found += 1
        seen = observations[partner[row]]
        if label.facing is not None:
            (figures.facing if label.facing else figures.away).append(seen.awareness)
        person = seen.keypoints
        similarity = None if person is None else label.similarity(person)
        if person is not None and similarity is not None and person.scores.any():
            figures.similarities.append(similarity)


def read_rgb(path: Path) -> NDArray[np.uint8]:
    """Read a photograph (H, W, 3); AwarenavError for a file that is none."""
    data = np.frombuffer(path.read_bytes(), np.uint8) if path.is_file() else None
    bgr = None if data is None else cv2.imdecode(data, cv2.IMREAD_COLOR)
    if bgr is None:
        raise AwarenavError(f"{path} must be a photograph that OpenCV reads")
    return np.ascontiguousarray(np.asarray(bgr, dtype=np.uint8)[..., ::-1])


def _share(part: float, whole: int) -> str:
    return f"{part / whole:.2f}" if whole else "–"


def run(parser: argparse.ArgumentParser, chosen: argparse.Namespace) -> None:
    """Print the figures."""
    try:
        labels = read_labels(chosen.folder)
        print(measure(chosen.folder, labels, chosen.networks, math.radians(chosen.fov)))
    except AwarenavError as cause:
        parser.error(str(cause))


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the folder of photographs, and how they were taken."""
    parser.add_argument("folder", type=Path, help=f"photographs and {LABELS}")
    add_networks(parser)
    parser.add_argument(
        "--fov", type=float, default=60.0, metavar="DEG", help="of the longer side (default: 60)"
    )
