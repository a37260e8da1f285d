"""Third-party person detectors, decoded as their makers say; used where their files are present."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import onnxruntime as ort
from paths import SHARED

MODELS = SHARED / "models"
#: Share of the workers that each network must find.
REQUIRED = {
    "rtmdet_nano_person_320_mmpose": 0.97,
    "yolox_nano_416_coco": 0.93,
    "yolov8n_int8_640_coco": 0.97,
}
_GREY = 114


@dataclass(frozen=True)
class People:
    """Boxes (N, 4) x1, y1, x2, y2 in pixels of the picture and their scores (N,)."""

    boxes_xyxy_px: np.ndarray
    scores: np.ndarray


class GenuineDetector:
    """One of :data:`REQUIRED`, by the name of its file."""

    def __init__(self, name: str) -> None:
        options = ort.SessionOptions()
        options.intra_op_num_threads = 1
        options.log_severity_level = 3
        options.add_session_config_entry("session.intra_op.allow_spinning", "0")
        self._session = ort.InferenceSession(
            str(MODELS / f"{name}.onnx"), options, providers=["CPUExecutionProvider"]
        )
        self._input = self._session.get_inputs()[0].name
        self._decode: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]] = {
            "rtmdet_nano_person_320_mmpose": self._rtmdet,
            "yolox_nano_416_coco": self._yolox,
            "yolov8n_int8_640_coco": self._yolov8,
        }[name]

    def people(self, image_rgb: np.ndarray, least_score: float = 0.05) -> People:
        """The people of a picture (H, W, 3), overlapping boxes suppressed at IoU 0.65."""
        boxes, scores = self._decode(image_rgb)
        keep = scores >= least_score
        boxes, scores = boxes[keep], scores[keep]
        sizes = np.concatenate([boxes[:, :2], boxes[:, 2:] - boxes[:, :2]], axis=1)
        kept = cv2.dnn.NMSBoxes(sizes.tolist(), scores.tolist(), least_score, 0.65)
        rows = np.asarray(kept, dtype=int).reshape(-1)
        return People(boxes[rows], scores[rows])

    def _run(self, blob: np.ndarray) -> list[np.ndarray]:
        return self._session.run(None, {self._input: np.ascontiguousarray(blob[None])})

    def _rtmdet(self, image_rgb: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        picture, scale, _ = _letterbox(image_rgb[..., ::-1], 320, centred=False)
        blob = (picture - np.array([103.53, 116.28, 123.675])) / np.array([57.375, 57.12, 58.395])
        detections, labels = self._run(blob.transpose(2, 0, 1).astype(np.float32))
        people = labels[0] == 0
        rows = detections[0][people]
        return rows[:, :4] / scale, rows[:, 4]

    def _yolox(self, image_rgb: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        picture, scale, _ = _letterbox(image_rgb[..., ::-1], 416, centred=False)
        (rows,) = self._run(picture.transpose(2, 0, 1).astype(np.float32))
        rows = rows[0]
        grids, strides = [], []
        for stride in (8, 16, 32):
            side = 416 // stride
            y, x = np.mgrid[:side, :side]
            grids.append(np.stack([x.ravel(), y.ravel()], axis=-1))
            strides.append(np.full((side * side, 1), stride))
        grid, step = np.concatenate(grids), np.concatenate(strides)
        centre, size = (rows[:, :2] + grid) * step, np.exp(rows[:, 2:4]) * step
        boxes = np.concatenate([centre - size / 2, centre + size / 2], axis=1) / scale
        return boxes, rows[:, 4] * rows[:, 5]

    def _yolov8(self, image_rgb: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        picture, scale, corner = _letterbox(image_rgb, 640, centred=True)
        (rows,) = self._run((picture / 255.0).transpose(2, 0, 1).astype(np.float32))
        rows = rows[0].T
        centre, size = rows[:, :2] - corner, rows[:, 2:4]
        boxes = np.concatenate([centre - size / 2, centre + size / 2], axis=1) / scale
        return boxes, rows[:, 4]


def _letterbox(
    image: np.ndarray, side: int, *, centred: bool
) -> tuple[np.ndarray, float, np.ndarray]:
    """Square picture, scale and the corner (2,) at which the scaled image lies in it."""
    height, width = image.shape[:2]
    scale = side / max(height, width)
    size = round(width * scale), round(height * scale)
    scaled = cv2.resize(np.ascontiguousarray(image), size, interpolation=cv2.INTER_LINEAR)
    corner = (np.array([side, side]) - size) // 2 if centred else np.zeros(2, int)
    out = np.full((side, side, 3), _GREY, np.float32)
    out[corner[1] : corner[1] + size[1], corner[0] : corner[0] + size[0]] = scaled
    return out, scale, corner


def iou(boxes: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Intersection over union of (N, 4) boxes with one (4,)."""
    low, high = np.maximum(boxes[:, :2], box[:2]), np.minimum(boxes[:, 2:], box[2:])
    shared = np.prod(np.clip(high - low, 0.0, None), axis=1)
    areas = np.prod(boxes[:, 2:] - boxes[:, :2], axis=1)
    return shared / (areas + np.prod(box[2:] - box[:2]) - shared)
