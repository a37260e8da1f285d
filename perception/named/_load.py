"""Networks by their names: loads those of files, of the package, and those that are fetched."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Final

from .._camera import Camera
from .._pnp import PnpHeadPoseEstimator
from .._stages import HeadPoseEstimator, PersonDetector, PoseEstimator
from ..confirmation import KeypointConfirmation
from ..errors import AwarenavError, PerceptionError
from ..networks import (
    BlazePoseEstimator,
    EfficientDetPersonDetector,
    OnnxModel,
    OnnxPersonDetector,
    OnnxPoseEstimator,
    OnnxSettings,
    TfliteModel,
    is_tflite,
)
from ..networks.detectors import for_wide_view
from ..networks.faces import FaceMesh, FaceMeshEyeEstimator, FaceMeshPoseEstimator
from ..networks.heads import OnnxHeadPoseEstimator
from ..networks.small_faces import RetinaFace
from ..shipped import (
    DETECTOR,
    HEAD,
    POSE,
    TrainingDomain,
    shipped_detector,
    shipped_head_pose_estimator,
    shipped_model,
    shipped_pose_estimator,
    verify_shipped_model,
)
from ._catalogue import RealModel
from ._folder import NetworkFolder, sha256_of

#: The name of the networks that come with the package.
SHIPPED: Final = "shipped"
NONE: Final = "none"
_WITHOUT_NETWORK: Final = "pnp"
EYES: Final = ("auto", NONE)
# What the messages of the networks' classes advise, and what the command has for it.
_WORDS: Final = {
    "--detector": {
        "person_class": "--person-class",
        "input_size_hw_px=(height, width)": "--input-size WxH",
        "input_size_hw_px": "--input-size",
    },
    "--pose": {
        "give it with input_size_hw_px=(height, width) in pixels": "export it with a fixed size",
    },
}
_SIZE: Final = re.compile("([1-9][0-9]{0,4})x([1-9][0-9]{0,4})")
# Families of detectors that a file may not tell apart.
_FAMILIES: Final = ("rtmdet", "yolox", "ultralytics")
HEADS: Final = ("auto", "network", _WITHOUT_NETWORK)


@dataclass(frozen=True, slots=True)
class Networks:
    """The detector and estimators of a pipeline.

    ``detector`` may be a function that makes the detector for a camera. ``training_domains`` says
    what each has seen in training, by its role; a role that is missing or None is not known.
    """

    detector: PersonDetector | Callable[[Camera], PersonDetector]
    pose_estimator: PoseEstimator
    head_pose_estimator: HeadPoseEstimator | None = None
    #: More settings of :class:`~perception.AwarenessPipeline` by name.
    settings: dict[str, Any] = field(default_factory=dict)
    training_domains: dict[str, TrainingDomain | None] = field(default_factory=dict)

    @property
    def make_detector(self) -> Callable[[Camera], PersonDetector]:
        """Return the detector for a camera.

        One that is not made for a camera looks twice at an image of more than 90° across
        (:func:`~perception.networks.detectors.for_wide_view`).
        """
        if isinstance(self.detector, PersonDetector):
            return partial(for_wide_view, self.detector)
        return self.detector


def choose_networks(
    detector: str = SHIPPED,
    pose: str = SHIPPED,
    head: str = HEADS[0],
    face: str = NONE,
    eyes: str = EYES[0],
    person_class: int | None = None,
    input_size: str | None = None,
    *,
    small_face: str = NONE,
    min_score: float | None = None,
    settings: OnnxSettings | None = None,
    detect_every_s: float = 0.0,
) -> Networks:
    """Load the networks.

    Args:
        detector: ``"shipped"``, an ONNX or TFLite file, or the name of a network that
            ``awarenav models fetch`` has downloaded (this holds for the others as well).
            ``rtmdet:FILE``, ``yolox:FILE`` and ``ultralytics:FILE`` say what a file is that does
            not tell it.
        pose: ``"shipped"``, or an ONNX or TFLite file.
        head: ``"network"`` (the shipped one), ``"pnp"`` (the paper's method), an ONNX file, or
            ``"auto"``: the shipped network with the shipped pose network, else PnP.
        face: ``"none"``, or a file ``face_landmarker.task`` of MediaPipe: faces of near people, and
            evidence that there is one.
        small_face: ``"none"``, or a file ``mobilenet0.25_Final.pth`` of RetinaFace: looks again
            where the network of faces finds none.
        eyes: ``"none"``, or ``"auto"``: from the irises that the network of faces finds.
        person_class: number of the class that counts, for a detector of your own; None for the one
            that it calls "person", else the first.
        input_size: width and height in pixels, as ``"640x480"``, for a detector of your own that
            leaves them free.
        min_score: people with a lower detection score are dropped; None for the detector's own
            threshold (the catalogue's, else 0.25).
        settings: providers and threads.
        detect_every_s: as :class:`~perception.AwarenessPipeline` takes it.

    Raises:
        PerceptionError: for a file that is missing, damaged or of an unknown layout.
        AwarenavError: for a word that is neither a valid name nor a file.
    """
    if eyes not in EYES:
        raise AwarenavError(f"--eyes must be {', '.join(map(repr, EYES))}, got {eyes!r}")
    if head == "auto":
        head = "network" if pose == SHIPPED else _WITHOUT_NETWORK
    if face == NONE != small_face:
        raise AwarenavError("--small-face looks again where --face finds none: give --face too")
    options: dict[str, Any] = {"detect_every_s": detect_every_s}
    if (detector, pose) == (SHIPPED, SHIPPED):
        confirmation = KeypointConfirmation(**_threshold(min_score))
        options["confirmation"] = confirmation
        min_score = confirmation.detector_threshold
    own: dict[str, Any] = {
        "person_class": person_class,
        "input_size_hw_px": _height_width(input_size),
    }
    with _in_words_of_options("--detector"):
        detector_used, detector_domain = _detector(detector, min_score, settings, own)
    with _in_words_of_options("--pose"):
        pose_used, pose_domain = _pose(pose, settings)
    domains = {"detector": detector_domain, "pose": pose_domain}
    if face != NONE:
        path, entry = _file("--face", face, (NONE,))
        mesh = FaceMesh(path, settings=settings, sha256=entry.sha256 if entry else None)
        small = None
        if small_face != NONE:
            path, entry = _file("--small-face", small_face, (NONE,))
            small = RetinaFace(path, settings=settings, sha256=entry.sha256 if entry else None)
        pose_used = FaceMeshPoseEstimator(pose_used, mesh, small)
        domains["face"] = "photographs"
        if eyes == "auto":
            options["eye_estimator"] = FaceMeshEyeEstimator()
    head_used, head_domain = _head(head, settings)
    if head != _WITHOUT_NETWORK:
        domains["head"] = head_domain
    return Networks(detector_used, pose_used, head_used, options, training_domains=domains)


@contextlib.contextmanager
def _in_words_of_options(option: str) -> Iterator[None]:
    """Let errors name the command's options in place of the arguments of a network's class."""
    try:
        yield
    except PerceptionError as cause:
        text = str(cause)
        for argument, words in _WORDS[option].items():
            text = text.replace(argument, words)
        raise type(cause)(text) from cause


def _height_width(size: str | None) -> tuple[int, int] | None:
    """Return height and width of a size as ``"640x480"``.

    Raises:
        AwarenavError: for another text.
    """
    if size is None:
        return None
    match = _SIZE.fullmatch(size)
    if match is None:
        raise AwarenavError(f"--input-size must be WxH in pixels, as 640x480, got {size!r:.60}")
    return int(match[2]), int(match[1])


def _detector(
    name: str, min_score: float | None, settings: OnnxSettings | None, own: dict[str, Any]
) -> tuple[PersonDetector | Callable[[Camera], PersonDetector], TrainingDomain | None]:
    if name == SHIPPED:
        if any(value is not None for value in own.values()):
            raise AwarenavError("--person-class and --input-size are for a --detector of your own")
        verify_shipped_model(DETECTOR)  # now, not at the first frame
        return (
            lambda camera: shipped_detector(settings, camera, **_threshold(min_score)),
            shipped_model(DETECTOR).training_domain,
        )
    prefix, colon, file = name.partition(":")
    family = prefix if colon and prefix in _FAMILIES else None
    model, entry = _model("--detector", file if family else name, (SHIPPED,), settings)
    if min_score is None and entry is not None:
        min_score = entry.score_threshold
    domain = _domain(model, entry)
    if isinstance(model, TfliteModel):
        return EfficientDetPersonDetector(model, **_threshold(min_score)), domain
    return OnnxPersonDetector(model, family=family, **_threshold(min_score), **own), domain


def _domain(model: OnnxModel | TfliteModel, entry: RealModel | None) -> TrainingDomain | None:
    """Return what a network was trained on, by the catalogue or else by its file."""
    return model.training_domain if entry is None else entry.training_domain


def _threshold(min_score: float | None) -> dict[str, Any]:
    """Return the argument of a detector's class; none leaves it to the class."""
    return {} if min_score is None else {"score_threshold": min_score}


def _pose(name: str, settings: OnnxSettings | None) -> tuple[PoseEstimator, TrainingDomain | None]:
    if name == SHIPPED:
        return shipped_pose_estimator(settings), shipped_model(POSE).training_domain
    model, entry = _model("--pose", name, (SHIPPED,), settings)
    domain = _domain(model, entry)
    if isinstance(model, TfliteModel):
        return BlazePoseEstimator(model), domain
    return OnnxPoseEstimator(model), domain


def _head(
    name: str, settings: OnnxSettings | None
) -> tuple[HeadPoseEstimator, TrainingDomain | None]:
    if name == _WITHOUT_NETWORK:
        return PnpHeadPoseEstimator(), None
    if name == "network":
        return shipped_head_pose_estimator(settings), shipped_model(HEAD).training_domain
    model, entry = _model("--head", name, HEADS, settings)
    own_domain = _domain(model, entry)
    if isinstance(model, TfliteModel):
        raise AwarenavError(f"--head takes an ONNX file, got the TFLite file {name}")
    return OnnxHeadPoseEstimator(model), own_domain


def _model(
    option: str, name: str, names: tuple[str, ...], settings: OnnxSettings | None
) -> tuple[OnnxModel | TfliteModel, RealModel | None]:
    """Load a network from a file, or one that is fetched, and return its entry if it is known.

    The sha256 of a fetched network is checked on the bytes that are loaded.
    """
    path, entry = _file(option, name, names)
    sha256 = None if entry is None else entry.sha256
    with path.open("rb") as file:
        tflite = is_tflite(file.read(8))
    return (TfliteModel if tflite else OnnxModel)(path, settings=settings, sha256=sha256), entry


def _file(option: str, name: str, names: tuple[str, ...]) -> tuple[Path, RealModel | None]:
    """Return the file of a network, and its entry if the catalogue knows it."""
    if Path(name).is_file():
        return Path(name), catalogued(name)
    store = NetworkFolder()
    if name in {each.name for each in store.catalogue.models}:
        return store.path(name), store.catalogue[name]
    raise AwarenavError(
        f"{option} must be {', '.join(map(repr, names))}, a file of a network, or a network that "
        f"'awarenav models list' names; there is no file {name!r}"
    )


def catalogued(name: str) -> RealModel | None:
    """Return the catalogue's entry of a network: of its name, else of the file's SHA-256."""
    catalogue = NetworkFolder().catalogue
    prefix, colon, rest = name.partition(":")
    path = Path(rest if colon and prefix in _FAMILIES else name)
    if path.is_file():
        return catalogue.known(sha256_of(path))
    return next((each for each in catalogue.models if each.name == str(path)), None)
