"""Loads the networks that are named on the command line."""

from __future__ import annotations

import contextlib
import hashlib
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, ClassVar, Final

from perception import (
    Camera,
    FusedHeadPoseEstimator,
    HeadPoseEstimator,
    OnnxHeadPoseEstimator,
    OnnxPersonDetector,
    OnnxPoseEstimator,
    PerceptionError,
    PersonDetector,
    PnpHeadPoseEstimator,
    PoseEstimator,
)
from perception.confirmation import KeypointConfirmation
from perception.networks import (
    BlazePoseEstimator,
    EfficientDetPersonDetector,
    OnnxModel,
    OnnxSettings,
    TfliteModel,
    is_tflite,
    parse_provider_options,
)
from perception.networks.faces import (
    FaceMesh,
    FaceMeshEyeEstimator,
    FaceMeshPoseEstimator,
)
from perception.networks.small_faces import RetinaFace
from perception.shipped import (
    DETECTOR,
    HEAD,
    POSE,
    TrainingDomain,
    shipped_detector,
    shipped_head_pose_estimator,
    shipped_model,
    shipped_pose_estimator,
    simulator_networks,
    simulator_networks_warning,
    verify_shipped_model,
)
from tracking.config import StrictConfig

from ..errors import AwarenavError
from ..models import DEFAULT_SET, ModelStore, RealModel
from ._estimator import Networks

#: The name of the networks that come with the package.
SHIPPED: Final = "shipped"
_NONE: Final = "none"
_WITHOUT_NETWORK: Final = "pnp"
_EYES: Final = ("auto", _NONE)
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
_HEADS: Final = ("auto", "network", _WITHOUT_NETWORK, "fused")


class NetworkChoice(StrictConfig):
    """The networks by name, as ``--networks`` reads them from a file.

    Attributes:
        detector: as :func:`choose_networks` takes it; so are the others.
        pose: pose network.
        head: head pose.
        face: network of faces.
        small_face: network of faces too small for that one.
        eyes: eyes of near people.
        person_class: of the detector.
        input_size: of the detector.
    """

    error: ClassVar[type[ValueError]] = AwarenavError

    detector: str = SHIPPED
    pose: str = SHIPPED
    head: str = _HEADS[0]
    face: str = _NONE
    small_face: str = _NONE
    eyes: str = _EYES[0]
    person_class: int | None = None
    input_size: str | None = None

    @classmethod
    def of_options(
        cls, options: Any, *, rendered: bool, log: Callable[[str], None] | None = None
    ) -> NetworkChoice:
        """Return the choice of a command's options: that of the file, else of the other ones.

        An option that is not given leaves the value of the file. Without a file it leaves that of
        the set ``real``, if that has been fetched and the pictures are no renders; else the shipped
        network.

        Args:
            options: with ``networks``, a path or None, and an attribute for each name here; None
                for an option that is not given.
            rendered: the pictures are renders of this package.
            log: gets one message if the set ``real`` is used.

        Raises:
            AwarenavError: for a file that cannot be read.
        """
        values = {name: getattr(options, name, None) for name in cls.model_fields}
        given = {name: value for name, value in values.items() if value is not None}
        if options.networks is not None:
            return cls.from_yaml(options.networks).model_copy(update=given)
        # Whoever allows networks of renders has asked for them.
        shipped = rendered or getattr(options, "allow_simulator_networks", False)
        fetched = None if shipped else cls._fetched()
        if fetched is None:
            return cls(**given)
        chosen = fetched.model_copy(update=given)
        if log is not None:
            used = chosen.model_dump(exclude_none=True).items()
            named = ", ".join(f"{role} {name}" for role, name in used if name not in _EYES)
            log(f"networks of the fetched set {DEFAULT_SET}: {named}")
        return chosen

    @classmethod
    def _fetched(cls) -> NetworkChoice | None:
        """Return the default set for photographs; None unless it has been fetched completely."""
        store = ModelStore()
        known = {each.name for each in store.catalogue.models}
        for each in store.catalogue.sets:
            if each.name == DEFAULT_SET:
                named = each.model_dump(include=set(cls.model_fields), exclude_none=True)
                chosen = cls(**named)
                wanted = known.intersection(map(str, named.values()))
                missing = [name for name in wanted if not store.is_fetched(name)]
                if missing == [each.small_face]:  # fetched before the set had it
                    return chosen.model_copy(update={"small_face": _NONE})
                return None if missing else chosen
        return None

    def catalogued(self) -> dict[str, RealModel]:
        """Return what the catalogue says of the networks, by their roles.

        A file is known by its SHA-256. A network that is not in the catalogue is left out.
        """
        named = self.model_dump(exclude_none=True)
        found = {role: _catalogued(str(name)) for role, name in named.items()}
        return {role: model for role, model in found.items() if model is not None}


def running_options(options: Any) -> dict[str, Any]:
    """Return what a command's options say of how networks run, for :func:`choose_networks`."""
    return {
        "threads": options.threads,
        "provider": options.provider,
        "provider_options": options.provider_options.split(),
        "detect_every_s": options.detect_every_s,
    }


def choose_networks(
    detector: str = SHIPPED,
    pose: str = SHIPPED,
    head: str = _HEADS[0],
    face: str = _NONE,
    eyes: str = _EYES[0],
    person_class: int | None = None,
    input_size: str | None = None,
    *,
    small_face: str = _NONE,
    min_score: float | None = None,
    threads: int | None = None,
    provider: str = "cpu",
    provider_options: Sequence[str] = (),
    detect_every_s: float = 0.0,
) -> Networks:
    """Load the networks.

    Args:
        detector: ``"shipped"``, an ONNX or TFLite file, or the name of a network that
            ``awarenav models fetch`` has downloaded (this holds for the others as well).
            ``rtmdet:FILE``, ``yolox:FILE`` and ``ultralytics:FILE`` say what a file is that does
            not tell it.
        pose: ``"shipped"``, or an ONNX or TFLite file.
        head: ``"network"`` (the shipped one), ``"pnp"`` (the paper's method), ``"fused"`` (both,
            weighted by their uncertainties), an ONNX file, or ``"auto"``: the shipped network with
            the shipped pose network, else PnP.
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
        threads: of each network; None leaves the number to onnxruntime.
        provider: one of :data:`~perception.networks.PROVIDERS`.
        provider_options: its options, as ``KEY=VALUE``.
        detect_every_s: as :class:`~perception.AwarenessPipeline` takes it.

    Raises:
        PerceptionError: for a file that is missing, damaged or of an unknown layout.
        AwarenavError: for a word that is neither a valid name nor a file.
    """
    if eyes not in _EYES:
        raise AwarenavError(f"--eyes must be {', '.join(map(repr, _EYES))}, got {eyes!r}")
    if head == "auto":
        head = "network" if pose == SHIPPED else _WITHOUT_NETWORK
    if face == _NONE != small_face:
        raise AwarenavError("--small-face looks again where --face finds none: give --face too")
    settings = OnnxSettings(((provider, parse_provider_options(provider_options)),), threads)
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
    if face != _NONE:
        path, entry = _file("--face", face, (_NONE,))
        mesh = FaceMesh(path, settings=settings, sha256=entry.sha256 if entry else None)
        small = None
        if small_face != _NONE:
            path, entry = _file("--small-face", small_face, (_NONE,))
            small = RetinaFace(path, settings=settings, sha256=entry.sha256 if entry else None)
        pose_used = FaceMeshPoseEstimator(pose_used, mesh, small)
        domains["face"] = "photographs"
        if eyes == "auto":
            options["eye_estimator"] = FaceMeshEyeEstimator()
    head_used, head_domain = _head(head, settings)
    if head != _WITHOUT_NETWORK:
        domains["head"] = head_domain
    return Networks(detector_used, pose_used, head_used, options, training_domains=domains)


def admit_networks(networks: Networks, *, rendered: bool, allowed: bool) -> tuple[str, ...]:
    """Return the roles of networks that see such pictures for the first time.

    Args:
        networks: to be used.
        rendered: the pictures are renders of this package.
        allowed: networks of renders may see other pictures.

    Raises:
        AwarenavError: if they see such pictures and may not.
    """
    roles = () if rendered else simulator_networks(networks.training_domains)
    if roles and not allowed:
        raise AwarenavError(
            f"{simulator_networks_warning(roles)}: `awarenav models fetch {DEFAULT_SET}` brings "
            "others, which are used from then on (or add --allow-simulator-networks)"
        )
    return roles


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
    name: str, min_score: float | None, settings: OnnxSettings, own: dict[str, Any]
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


def _pose(name: str, settings: OnnxSettings) -> tuple[PoseEstimator, TrainingDomain | None]:
    if name == SHIPPED:
        return shipped_pose_estimator(settings), shipped_model(POSE).training_domain
    model, entry = _model("--pose", name, (SHIPPED,), settings)
    domain = _domain(model, entry)
    if isinstance(model, TfliteModel):
        return BlazePoseEstimator(model), domain
    return OnnxPoseEstimator(model), domain


def _head(name: str, settings: OnnxSettings) -> tuple[HeadPoseEstimator, TrainingDomain | None]:
    if name == _WITHOUT_NETWORK:
        return PnpHeadPoseEstimator(), None
    if name in ("network", "fused"):
        shipped = shipped_head_pose_estimator(settings)
        domain = shipped_model(HEAD).training_domain
        if name == "network":
            return shipped, domain
        return FusedHeadPoseEstimator(shipped, PnpHeadPoseEstimator()), domain
    model, entry = _model("--head", name, _HEADS, settings)
    own_domain = _domain(model, entry)
    if isinstance(model, TfliteModel):
        raise AwarenavError(f"--head takes an ONNX file, got the TFLite file {name}")
    return OnnxHeadPoseEstimator(model), own_domain


def _model(
    option: str, name: str, names: tuple[str, ...], settings: OnnxSettings
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
        return Path(name), _catalogued(name)
    store = ModelStore()
    if name in {each.name for each in store.catalogue.models}:
        return store.path(name), store.catalogue[name]
    raise AwarenavError(
        f"{option} must be {', '.join(map(repr, names))}, a file of a network, or a network that "
        f"'awarenav models list' names; there is no file {name!r}"
    )


def _catalogued(name: str) -> RealModel | None:
    """Return the catalogue's entry of a network: of its name, else of the file's SHA-256."""
    catalogue = ModelStore().catalogue
    prefix, colon, rest = name.partition(":")
    path = Path(rest if colon and prefix in _FAMILIES else name)
    if path.is_file():
        return catalogue.known(hashlib.sha256(path.read_bytes()).hexdigest())
    return next((each for each in catalogue.models if each.name == str(path)), None)
