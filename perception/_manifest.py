"""The manifest of the shipped networks, and what a network has seen in training.

``models/manifest.json`` lists each shipped file with its size and SHA-256. ``training/`` writes it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Final, Literal, get_args

from .documents import read_json
from .errors import PerceptionError
from .installation import reinstall_command

DETECTOR: Final = "person_detector"
POSE: Final = "person_pose"
HEAD: Final = "head_pose"
LEGS: Final = "leg_classifier"

#: What a network has seen in training. Networks of renders or simulated scans have never seen a
#: real person.
TrainingDomain = Literal["renders", "photographs", "simulated scans"]
TRAINING_DOMAINS: Final[tuple[TrainingDomain, ...]] = get_args(TrainingDomain)
#: Key of the training domain in the metadata of an ONNX file.
TRAINING_DOMAIN_KEY: Final = "training_domain"

_FOLDER: Final = Path(__file__).parent / "models"
_MANIFEST: Final = "manifest.json"


@dataclass(frozen=True, slots=True)
class ShippedModel:
    """A shipped network.

    Attributes:
        name: name, for example ``"person_detector"``. The file is ``name + ".onnx"``, the card
            ``name + ".md"``.
        sha256: SHA-256 of the file, 64 lower-case hexadecimal digits.
        size_bytes: size of the file.
        licence: SPDX identifier.
        input: shape and colour order, in words.
        summary: purpose, in a sentence.
        training_domain: what it has seen in training, one of :data:`TRAINING_DOMAINS`.
    """

    name: str
    sha256: str
    size_bytes: int
    licence: str
    input: str
    summary: str
    training_domain: TrainingDomain

    @property
    def file(self) -> str:
        """Name of the file in the folder of the manifest."""
        return f"{self.name}.onnx"


def shipped_models(folder: Path | None = None) -> tuple[ShippedModel, ...]:
    """Return the networks that the manifest lists; the files themselves are not checked.

    Args:
        folder: folder of the manifest; default that of this package.

    Raises:
        PerceptionError: for a missing or invalid manifest.
    """
    path = (_FOLDER if folder is None else folder) / _MANIFEST
    if not path.is_file():
        raise PerceptionError(
            f"the list of shipped networks {path} cannot be read (no such file); "
            f"put it back: {reinstall_command()}"
        )
    try:
        entries = read_json(path)["models"]
        return tuple(ShippedModel(**entry) for entry in entries)
    except (ValueError, KeyError, TypeError) as cause:
        wanted = ", ".join(field.name for field in fields(ShippedModel))
        raise PerceptionError(
            f"{path} must hold a list 'models' of objects with {wanted}: {cause}; "
            f"put it back: {reinstall_command()}"
        ) from cause


def shipped_model(name: str, folder: Path | None = None) -> ShippedModel:
    """Return the manifest's entry of a shipped network.

    Raises:
        PerceptionError: for an unknown name; the message says which names there are.
    """
    known = shipped_models(folder)
    for model in known:
        if model.name == name:
            return model
    listed = ", ".join(repr(model.name) for model in known) or "none"
    raise PerceptionError(f"this build ships no network {name!r}; it ships: {listed}")


def shipped_model_path(name: str, folder: Path | None = None) -> Path:
    """Return the path of a shipped network's file, which exists; its content is not checked.

    Raises:
        PerceptionError: for an unknown name or a missing file.
    """
    model = shipped_model(name, folder)
    path = (_FOLDER if folder is None else folder) / model.file
    if not path.is_file():
        raise PerceptionError(
            f"the shipped network {path} is missing (sha256 {model.sha256}, "
            f"{model.size_bytes} bytes); put it back: {reinstall_command()}"
        )
    return path


def verify_shipped_model(name: str, folder: Path | None = None) -> Path:
    """Check the SHA-256 of a shipped network's file against the manifest and return its path.

    Raises:
        PerceptionError: for an unknown name, a missing file, or another SHA-256; the message says
            both.
    """
    model = shipped_model(name, folder)
    path = shipped_model_path(name, folder)
    content = path.read_bytes()
    found = hashlib.sha256(content).hexdigest()
    if found != model.sha256:
        raise PerceptionError(
            f"the shipped network {path} has been altered: its sha256 is {found} "
            f"({len(content)} bytes), expected {model.sha256} ({model.size_bytes} bytes); "
            f"put it back: {reinstall_command()}"
        )
    return path


def training_domain_of(content: bytes, metadata: Mapping[str, str]) -> TrainingDomain | None:
    """Return what a network has seen in training; None if nothing says so.

    Its metadata say it under ``training_domain``. A copy of a shipped network is known by its
    SHA-256.

    Args:
        content: of the ONNX file.
        metadata: of the ONNX file.
    """
    told = metadata.get(TRAINING_DOMAIN_KEY)
    for domain in TRAINING_DOMAINS:
        if told == domain:
            return domain
    try:
        alike = [model for model in shipped_models() if model.size_bytes == len(content)]
    except PerceptionError:  # a damaged installation: loading a shipped network says so
        return None
    sha256 = hashlib.sha256(content).hexdigest() if alike else ""
    return next((model.training_domain for model in alike if model.sha256 == sha256), None)


def simulator_networks(domains: Mapping[str, TrainingDomain | None]) -> tuple[str, ...]:
    """Return the roles whose networks have seen renders only.

    Args:
        domains: training domain of each network by its role: ``"detector"``, ``"pose"``, …
    """
    return tuple(role for role, domain in domains.items() if domain == "renders")


def simulator_networks_warning(roles: tuple[str, ...]) -> str:
    """Return a sentence about networks that have seen renders only, without a full stop."""
    if len(roles) == 1:
        return f"the {roles[0]} network has seen renders only, and no photograph of a person"
    listed = f"{', '.join(roles[:-1])} and {roles[-1]}"
    return f"the {listed} networks have seen renders only, and no photograph of a person"
