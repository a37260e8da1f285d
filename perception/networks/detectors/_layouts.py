"""Layouts of detectors, recognised from the shapes of the outputs and from the metadata."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...errors import PerceptionError
from .._images import IMAGENET_MEAN_RGB, IMAGENET_STD_RGB, PixelFormat
from .._model import OnnxModel, output_shapes
from ._decoders import (
    STRIDES,
    Decoder,
    cell_count,
    cells,
    decode_dets,
    decode_rows,
    decode_yolov8,
    decode_yolox,
)

_KNOWN: Final = (
    "YOLOv8/11 and relatives (1, 4 + classes, N), N cells of strides 8, 16 and 32; "
    "rows of a network without or with its own NMS (1, M, 6); "
    "YOLOX raw (1, N, 5 + classes); "
    "RTMDet, or YOLOX with its own NMS, dets (1, N, 5) and labels (1, N)"
)
# Feature pyramids of the YOLOv8 family: the usual one, with a coarser and with a finer level.
_PYRAMIDS: Final = (STRIDES, (*STRIDES, 64), (4, *STRIDES))
_COCO_CLASSES: Final = 80
_ROW_LENGTH: Final = 6
# YOLOX's raw offsets and logarithms of sizes, in cells, are smaller; boxes in pixels are not.
_LARGEST_RAW: Final = 16.0

_ULTRALYTICS: Final = {"std_rgb": (255.0, 255.0, 255.0)}
_YOLOX: Final = {"bgr": True}
# OpenMMLab's configs of RTMDet list mean and standard deviation in the order blue, green, red.
_RTMDET: Final = {"mean_rgb": IMAGENET_MEAN_RGB, "std_rgb": IMAGENET_STD_RGB, "bgr": True}
# Pixels that families of detectors want, where their outputs do not tell them apart.
_FAMILIES: Final[dict[str, dict[str, Any]]] = {
    "rtmdet": _RTMDET,
    "yolox": _YOLOX,
    "ultralytics": _ULTRALYTICS,
}
# Those that OpenMMLab exports with the same outputs ``dets`` and ``labels``: names of the layouts.
_WITH_DETS: Final = {"rtmdet": "RTMDet", "yolox": "YOLOX with NMS"}
# Keys of the metadata that Ultralytics and its relatives write.
_ULTRALYTICS_KEYS: Final = ("names", "task", "imgsz", "end2end")
# Words in the names of weights and nodes of their heads: of RTMDet's, and of YOLOX's branch for
# objectness, in the code of Megvii and in that of OpenMMLab.
_FAMILY_WORDS: Final = {
    "rtmdet": ("rtm_cls", "rtm_reg"),
    "yolox": ("obj_preds", "multi_level_conv_obj"),
}


@dataclass(frozen=True, slots=True)
class DetectorLayout:
    """Layout of a detector: the form of its input and of its outputs.

    Attributes:
        name: name for messages.
        pixels: pixel format of the input.
        centred: True if the image lies in the middle of the input, False if at its top left.
        decoder: reads the outputs.
    """

    name: str
    pixels: PixelFormat
    centred: bool
    decoder: Decoder


@dataclass(frozen=True, slots=True)
class TrialRun:
    """A run of a detector on an empty input, which shows the extents of all outputs.

    Attributes:
        model: the network.
        outputs: its outputs.
        height_px: height of the input.
        width_px: width of the input.
        dtype: number type of the input.
        person_class: class number given by the caller, or None.
        family: family given by the caller, or None.
    """

    model: OnnxModel
    outputs: Sequence[NDArray[Any]]
    height_px: int
    width_px: int
    dtype: str
    person_class: int | None = None
    family: str | None = None

    def refusal(self, reason: str) -> PerceptionError:
        """Return an error that says what was found and which layouts are known."""
        names = class_names(self.model)
        classes = "" if names is None else f", metadata naming {len(names)} class(es)"
        return PerceptionError(
            f"{self.model.name} is not a person detector of a known layout: {reason}. Found input "
            f"(1, 3, {self.height_px}, {self.width_px}) -> "
            f"{output_shapes(self.model, self.outputs)}{classes}. Known: {_KNOWN}"
        )


def recognise(trial: TrialRun) -> DetectorLayout:
    """Recognise the layout of a detector.

    Raises:
        PerceptionError: for an unknown layout, and for one that fits two known layouts.
    """
    task = trial.model.metadata.get("task", "detect")
    if task != "detect":
        raise trial.refusal(f"its metadata says that its task is {task!r}, not 'detect'")
    shapes = [output.shape for output in trial.outputs]
    if any(0 in shape[:1] or shape[0] != 1 for shape in shapes if shape):
        raise trial.refusal("its outputs do not have batch size 1 for one image")
    if len(shapes) == 2:
        return _dets(trial)
    if len(shapes) != 1 or len(shapes[0]) != 3:
        raise trial.refusal("no known detector has such outputs")
    return _single_output(trial, shapes[0][1], shapes[0][2])


def _single_output(trial: TrialRun, first: int, second: int) -> DetectorLayout:
    """Recognise a detector with one output (1, first, second)."""
    size = trial.height_px, trial.width_px
    names = class_names(trial.model)
    found: list[str] = []
    if (
        second in {cell_count(*size, strides) for strides in _PYRAMIDS}
        and first >= 5
        and (names is None or first == 4 + len(names))
    ):
        found.append("YOLOv8")
    in_cells = first == cell_count(*size)
    if second == _ROW_LENGTH and (not in_cells or _are_boxes(trial)):
        found.append("rows")
    elif in_cells and second >= 6 and second == 5 + _class_count(names, second):
        found.append("YOLOX raw")
    if len(found) > 1:
        raise trial.refusal(f"it could be {' or '.join(found)}")
    if not found:
        wanted = cell_count(*size)
        raise trial.refusal(f"an input of this size has {wanted} cells of strides 8, 16 and 32")
    if found == ["YOLOv8"]:
        return _yolov8(trial, first - 4)
    return _rows(trial) if found == ["rows"] else _yolox(trial, second - 5)


def _class_count(names: dict[int, str] | None, row_length: int) -> int:
    """Return the number of classes of a raw YOLOX with rows of this length.

    Without class names, rows of 84 numbers are those of a transposed YOLOv8 of COCO.
    """
    if names is not None:
        return len(names)
    return _COCO_CLASSES if row_length == 4 + _COCO_CLASSES else row_length - 5


def _are_boxes(trial: TrialRun) -> bool:
    """Return whether (1, cells, 6) are boxes in pixels with a class, not YOLOX's raw numbers."""
    numbers = trial.outputs[0][0].astype(np.float32)
    classes = numbers[:, 5]
    whole = bool((classes == np.rint(classes)).all())
    # An NMS that finds nobody may leave nothing but zeros, a raw head never does.
    return whole and (not numbers.any() or float(np.abs(numbers[:, :4]).max()) > _LARGEST_RAW)


def _yolov8(trial: TrialRun, classes: int) -> DetectorLayout:
    person = _person_class(trial, classes)
    return DetectorLayout(
        "YOLOv8", _pixels(trial, _ULTRALYTICS), True, partial(decode_yolov8, person_class=person)
    )


def _rows(trial: TrialRun) -> DetectorLayout:
    decoder = partial(decode_rows, person_class=_person_class(trial, None))
    family = trial.family or family_of(trial.model)
    if family is None:
        if not any(key in trial.model.metadata for key in _ULTRALYTICS_KEYS):
            raise PerceptionError(
                f"{trial.model.name} has the output (1, M, 6) of several families of detectors, "
                "which want different pixels, and neither its metadata nor the names of its parts "
                "tell which it is; say it with family='ultralytics', 'yolox' or 'rtmdet' "
                "(--detector ultralytics:FILE, yolox:FILE or rtmdet:FILE on the command line)"
            )
        family = "ultralytics"
    pixels, centred = _FAMILIES[family], family == "ultralytics"
    return DetectorLayout("rows (NMS inside)", _pixels(trial, pixels), centred, decoder)


def _yolox(trial: TrialRun, classes: int) -> DetectorLayout:
    size = trial.height_px, trial.width_px
    if _is_decoded(trial.outputs[0][0], *size):
        if (trial.outputs[0][0][:, 4] == 1.0).all():
            raise trial.refusal(
                "it looks like YOLOv6, whose rows have 1 in place of YOLOX's objectness, and which "
                "is not read: export another network of those named below"
            )
        raise trial.refusal(
            "it looks like YOLOX with boxes decoded in the network; export it with "
            "decode_in_inference=False"
        )
    decoder = partial(decode_yolox, person_class=_person_class(trial, classes), grid=cells(*size))
    return DetectorLayout("YOLOX raw", _pixels(trial, _YOLOX), False, decoder)


def _is_decoded(rows: NDArray[Any], height_px: int, width_px: int) -> bool:
    """Return True if the centres lie near their cells, in pixels, and not near zero."""
    places, strides = cells(height_px, width_px)
    centres = rows[:, :2].astype(np.float32)
    near_cell = np.abs(centres - (places + 0.5) * strides) < 2.0 * strides
    near_zero = np.abs(centres) < 8.0
    return float(near_cell.mean()) > max(0.5, float(near_zero.mean()))


def _dets(trial: TrialRun) -> DetectorLayout:
    shapes = [output.shape for output in trial.outputs]
    for dets, labels in ((0, 1), (1, 0)):
        integers = np.issubdtype(trial.outputs[labels].dtype, np.integer)
        if len(shapes[dets]) == 3 and shapes[dets][2] == 5 and shapes[labels] == shapes[dets][:2]:
            if not integers:
                break
            family = trial.family or family_of(trial.model)
            if family not in _WITH_DETS:
                raise PerceptionError(
                    f"{trial.model.name} has the outputs of RTMDet and of YOLOX with its own NMS, "
                    "which want different pixels, and the names of its parts do not tell which it "
                    "is; say it with family='rtmdet' or family='yolox' (--detector rtmdet:FILE "
                    "or yolox:FILE on the command line)"
                )
            decoder = partial(
                decode_dets, person_class=_person_class(trial, None), dets=dets, labels=labels
            )
            pixels = _pixels(trial, _FAMILIES[family])
            return DetectorLayout(_WITH_DETS[family], pixels, False, decoder)
    raise trial.refusal("of the known detectors only RTMDet and YOLOX with NMS have two outputs")


def family_of(model: OnnxModel) -> str | None:
    """Return ``"rtmdet"`` or ``"yolox"`` by the names of its parts; None if they do not tell."""
    found = [family for family, words in _FAMILY_WORDS.items() if model.holds_any(words)]
    return found[0] if len(found) == 1 else None


def checked_family(family: Any) -> str | None:
    """Return the family that a caller gives, or None.

    Raises:
        PerceptionError: for another one.
    """
    if family is not None and family not in _FAMILIES:
        raise PerceptionError(
            f"family must be one of {', '.join(map(repr, _FAMILIES))} or None, got {family!r}"
        )
    return None if family is None else str(family)


def _pixels(trial: TrialRun, values: dict[str, Any]) -> PixelFormat:
    return PixelFormat(**values, dtype=trial.dtype)


def _person_class(trial: TrialRun, classes: int | None) -> int:
    """Return the number of the class that counts, for a network of ``classes`` if that is known."""
    names = class_names(trial.model)
    given = trial.person_class
    if given is not None:
        count = classes if classes is not None else None if names is None else len(names)
        if count is not None and given >= count:
            raise PerceptionError(
                f"person_class must lie in [0, {count - 1}] for {trial.model.name}, got {given}"
            )
        return given
    # Exports without names give the classes numbers as names. COCO's first class is the person.
    if names is None or all(name.isdigit() for name in names.values()):
        return 0
    for number, name in names.items():
        if name.lower() == "person":
            return number
    listed = ", ".join(repr(name) for name in list(names.values())[:8])
    raise PerceptionError(
        f"{trial.model.name} names no class 'person' but {listed}"
        f"{', …' if len(names) > 8 else ''}; give the number of the class with person_class"
    )


def class_names(model: OnnxModel) -> dict[int, str] | None:
    """Return the class names in the metadata ``names``, by number; None without class names."""
    names = _metadata_literal(model, "names")
    if isinstance(names, (list, tuple)):
        names = dict(enumerate(names))
    if not isinstance(names, dict) or not names:
        return None
    if not all(isinstance(number, int) for number in names):
        return None
    return {number: str(name).strip() for number, name in names.items()}


def metadata_size(model: OnnxModel) -> tuple[int, int] | None:
    """Return height and width from the metadata ``imgsz``, or None without them."""
    size = _metadata_literal(model, "imgsz")
    if isinstance(size, int):
        size = (size, size)
    if (
        isinstance(size, (list, tuple))
        and len(size) == 2
        and all(isinstance(side, int) and side > 0 for side in size)
    ):
        return size[0], size[1]
    return None


def _metadata_literal(model: OnnxModel, key: str) -> Any:
    """Return a Python literal from the metadata; None where it is missing or no literal."""
    try:
        return ast.literal_eval(model.metadata.get(key, "None"))
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return None
