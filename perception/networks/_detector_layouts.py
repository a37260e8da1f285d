"""Which detector a file holds, told from the shapes of its outputs and from its metadata."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..errors import PerceptionError
from ._box_format import BoxFormatVote
from ._detector_decoders import (
    STRIDES,
    Decoder,
    RowsDecoder,
    RtmdetDecoder,
    YoloV8Decoder,
    YoloxDecoder,
    cell_count,
    cells,
)
from ._pixels import PixelFormat
from ._session import OnnxModel

KNOWN: Final = (
    "YOLOv8/11 and relatives (1, 4 + classes, N), N cells of strides 8, 16 and 32; "
    "rows of a network without or with its own NMS (1, M, 6); "
    "YOLOX raw (1, N, 5 + classes); "
    "RTMDet dets (1, N, 5) and labels (1, N)"
)
# Other pyramids of the same family: with a coarser and with a finer level.
_PYRAMIDS: Final = (STRIDES, (*STRIDES, 64), (4, *STRIDES))
_COCO_CLASSES: Final = 80
_ROW_LENGTH: Final = 6

_ULTRALYTICS: Final = {"std_rgb": (255.0, 255.0, 255.0)}
_YOLOX: Final = {"bgr": True}
# OpenMMLab's configs of RTMDet list these for blue, green, red.
_RTMDET: Final = {
    "mean_rgb": (123.675, 116.28, 103.53),
    "std_rgb": (58.395, 57.12, 57.375),
    "bgr": True,
}


@dataclass(frozen=True, slots=True)
class DetectorLayout:
    """How to feed a detector and how to read it.

    Attributes:
        name: for messages.
        pixels: what its pixels look like.
        centred: whether the picture lies in the middle of the input or at its top left.
        decoder: reads its outputs.
    """

    name: str
    pixels: PixelFormat
    centred: bool
    decoder: Decoder


@dataclass(frozen=True, slots=True)
class Trial:
    """A detector that has been run once on an empty input, so that all its extents are known.

    Attributes:
        model: the network.
        outputs: what it put out.
        height_px: of the input.
        width_px: of the input.
        dtype: of the input.
        person_class: the caller's, or None.
        box_format: the caller's, or None.
    """

    model: OnnxModel
    outputs: Sequence[NDArray[Any]]
    height_px: int
    width_px: int
    dtype: str
    person_class: int | None = None
    box_format: str | None = None

    def refusal(self, reason: str) -> PerceptionError:
        """An error that says what was found and what is known."""
        shapes = (
            f"{tensor.name} {output.shape}"
            for tensor, output in zip(self.model.outputs, self.outputs, strict=True)
        )
        names = class_names(self.model)
        described = "" if names is None else f", metadata naming {len(names)} class(es)"
        return PerceptionError(
            f"{self.model.name} is no person detector of a known layout: {reason}. Found input "
            f"(1, 3, {self.height_px}, {self.width_px}) -> {', '.join(shapes)}{described}. "
            f"Known: {KNOWN}"
        )


def recognise(trial: Trial) -> DetectorLayout:
    """Tell the layout of a detector.

    Raises:
        PerceptionError: for a layout that is not known, or that could be two of those known.
    """
    task = trial.model.metadata.get("task", "detect")
    if task != "detect":
        raise trial.refusal(f"its metadata says that its task is {task!r}, not 'detect'")
    shapes = [output.shape for output in trial.outputs]
    if any(0 in shape[:1] or shape[0] != 1 for shape in shapes if shape):
        raise trial.refusal("it does not put out one batch for one picture")
    if len(shapes) == 2:
        return _rtmdet(trial)
    if len(shapes) != 1 or len(shapes[0]) != 3:
        raise trial.refusal("no known detector has such outputs")
    return _single_output(trial, shapes[0][1], shapes[0][2])


def _single_output(trial: Trial, first: int, second: int) -> DetectorLayout:
    size = trial.height_px, trial.width_px
    counts = {cell_count(*size, strides) for strides in _PYRAMIDS}
    names = class_names(trial.model)
    candidates: dict[str, Any] = {}
    if second in counts and first >= 5 and (names is None or first == 4 + len(names)):
        candidates["YOLOv8"] = lambda: _yolov8(trial, first - 4)
    if first == cell_count(*size):
        if second >= 6 and (names is None or second == 5 + len(names)):
            candidates["YOLOX raw"] = lambda: _yolox(trial, second - 5)
        # Without names only COCO's 80 classes or a lone one give a transposed YOLOv8 away.
        classes = second - 4
        if classes in ((1, _COCO_CLASSES) if names is None else (len(names),)):
            candidates["YOLOv8 with its axes swapped"] = None
    elif second == _ROW_LENGTH:
        candidates["rows"] = lambda: _rows(trial)
    if len(candidates) > 1:
        raise trial.refusal(f"it could be {' or '.join(candidates)}")
    make = next(iter(candidates.values()), None)
    if make is None:
        raise trial.refusal(_reason(trial, first, second, candidates))
    layout: DetectorLayout = make()
    return layout


def _reason(trial: Trial, first: int, second: int, candidates: dict[str, Any]) -> str:
    wanted = cell_count(trial.height_px, trial.width_px)
    if candidates:
        return f"it looks like {next(iter(candidates))}; export it as (1, {second}, {first})"
    if 3 * wanted in (first, second):
        return "it has three places a cell, as YOLOv5 and YOLOv7 with their anchors have"
    if wanted in (first, second):
        extent = second if first == wanted else first
        return f"{extent} numbers a place do not agree with the classes that its metadata names"
    return f"an input of this size has {wanted} cells of strides 8, 16 and 32"


def _yolov8(trial: Trial, classes: int) -> DetectorLayout:
    person = _person_class(trial, classes)
    return DetectorLayout("YOLOv8", _pixels(trial, _ULTRALYTICS), True, YoloV8Decoder(person))


def _rows(trial: Trial) -> DetectorLayout:
    input_px = (trial.width_px, trial.height_px)
    vote = BoxFormatVote(trial.box_format)
    rows = trial.outputs[0][0].astype(np.float32)
    vote.listen(rows[:, :4], rows[:, 4], input_px)
    decoder = RowsDecoder(_person_class(trial, None), vote, input_px)
    return DetectorLayout("rows (NMS inside)", _pixels(trial, _ULTRALYTICS), True, decoder)


def _yolox(trial: Trial, classes: int) -> DetectorLayout:
    size = trial.height_px, trial.width_px
    if _is_decoded(trial.outputs[0][0], *size):
        raise trial.refusal(
            "it looks like YOLOX with boxes decoded in the network; export it with "
            "decode_in_inference=False"
        )
    decoder = YoloxDecoder(_person_class(trial, classes), *size)
    return DetectorLayout("YOLOX raw", _pixels(trial, _YOLOX), False, decoder)


def _is_decoded(rows: NDArray[Any], height_px: int, width_px: int) -> bool:
    """Whether centres lie near their own cells in pixels rather than near zero."""
    places, strides = cells(height_px, width_px)
    centres = rows[:, :2].astype(np.float32)
    near_cell = np.abs(centres - (places + 0.5) * strides) < 2.0 * strides
    near_zero = np.abs(centres) < 8.0
    return float(near_cell.mean()) > max(0.5, float(near_zero.mean()))


def _rtmdet(trial: Trial) -> DetectorLayout:
    shapes = [output.shape for output in trial.outputs]
    for dets, labels in ((0, 1), (1, 0)):
        whole = np.issubdtype(trial.outputs[labels].dtype, np.integer)
        if len(shapes[dets]) == 3 and shapes[dets][2] == 5 and shapes[labels] == shapes[dets][:2]:
            if not whole:
                break
            decoder = RtmdetDecoder(_person_class(trial, None), dets, labels)
            return DetectorLayout("RTMDet", _pixels(trial, _RTMDET), False, decoder)
    raise trial.refusal("two outputs are known of RTMDet only")


def _pixels(trial: Trial, values: dict[str, Any]) -> PixelFormat:
    return PixelFormat(**values, dtype=trial.dtype)


def _person_class(trial: Trial, classes: int | None) -> int:
    names = class_names(trial.model)
    given = trial.person_class
    if given is not None:
        count = classes if classes is not None else None if names is None else len(names)
        if count is not None and given >= count:
            raise PerceptionError(
                f"person_class must lie in [0, {count - 1}] for {trial.model.name}, got {given}"
            )
        return given
    # Exports without names number their classes; COCO's first is the person.
    if names is None or all(name.isdigit() for name in names.values()):
        return 0
    for number, name in names.items():
        if name.lower() == "person":
            return number
    listed = ", ".join(repr(name) for name in list(names.values())[:8])
    raise PerceptionError(
        f"{trial.model.name} names no class 'person' but {listed}"
        f"{', …' if len(names) > 8 else ''}; say which one counts with person_class"
    )


def class_names(model: OnnxModel) -> dict[int, str] | None:
    """The classes that the metadata ``names`` lists, by number; None where it lists none."""
    try:
        names = ast.literal_eval(model.metadata.get("names", "None"))
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return None
    if isinstance(names, (list, tuple)):
        names = dict(enumerate(names))
    if not isinstance(names, dict) or not names:
        return None
    if not all(isinstance(number, int) for number in names):
        return None
    return {number: str(name).strip() for number, name in names.items()}


def metadata_size(model: OnnxModel) -> tuple[int, int] | None:
    """Height and width that the metadata ``imgsz`` gives, or None."""
    try:
        size = ast.literal_eval(model.metadata.get("imgsz", "None"))
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return None
    if isinstance(size, int):
        size = (size, size)
    if (
        isinstance(size, (list, tuple))
        and len(size) == 2
        and all(isinstance(side, int) and side > 0 for side in size)
    ):
        return size[0], size[1]
    return None
