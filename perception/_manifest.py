"""The manifest of the shipped networks: reading it, checking files against it, writing it.

``models/manifest.json`` lists each shipped file with its size and SHA-256. When ``training/``
exports the networks, :func:`write_manifest` writes it and the facts in each network's card.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Final, Literal, get_args

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
_NAME: Final = re.compile(r"[a-z0-9_]+")
_SHA256: Final = re.compile(r"[0-9a-f]{64}")


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

    def __post_init__(self) -> None:
        texts = (self.name, self.sha256, self.licence, self.input, self.summary)
        if not all(isinstance(text, str) and text for text in texts):
            raise PerceptionError(f"a shipped model needs all of its texts, got {texts}")
        if not _NAME.fullmatch(self.name):
            raise PerceptionError(f"name must match {_NAME.pattern}, got {self.name!r}")
        if not _SHA256.fullmatch(self.sha256):
            raise PerceptionError(
                f"sha256 must be 64 lower-case hexadecimal digits, got {self.sha256!r}"
            )
        if self.training_domain not in TRAINING_DOMAINS:
            raise PerceptionError(
                f"training_domain must be one of {', '.join(map(repr, TRAINING_DOMAINS))}, "
                f"got {self.training_domain!r}"
            )
        if type(self.size_bytes) is not int or self.size_bytes < 1:
            raise PerceptionError(f"size_bytes must be at least 1, got {self.size_bytes!r}")

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
    found, size_bytes = _digest(path)
    if found != model.sha256:
        raise PerceptionError(
            f"the shipped network {path} has been altered: its sha256 is {found} "
            f"({size_bytes} bytes), expected {model.sha256} ({model.size_bytes} bytes); "
            f"put it back: {reinstall_command()}"
        )
    return path


def write_manifest(folder: Path, entries: Sequence[Mapping[str, str]]) -> Path:
    """Write the manifest of the networks in ``folder``, and its facts into their cards.

    Args:
        folder: folder with ``name.onnx`` of each entry. In a card ``name.md``, if there is one, the
            lines that begin with ``- sha256:``, ``- size_bytes:``, ``- licence:``, ``- input:`` and
            ``- training_domain:`` are replaced; each must occur once.
        entries: ``name``, ``licence``, ``input``, ``summary`` and ``training_domain`` of each
            network; size and SHA-256 are computed from the file.

    Returns:
        The path of the manifest. Each file is replaced as a whole, the manifest last.

    Raises:
        PerceptionError: for a missing file, or a card without one of the lines.
    """
    models = []
    cards: dict[Path, str] = {}
    for entry in entries:
        path = folder / f"{entry['name']}.onnx"
        card = path.with_suffix(".md")
        try:
            sha256, size_bytes = _digest(path)
            text = card.read_text(encoding="utf-8") if card.exists() else None
        except OSError as cause:
            raise PerceptionError(f"cannot read {cause.filename}: {cause.strerror}") from cause
        facts: dict[str, Any] = {**entry, "sha256": sha256, "size_bytes": size_bytes}
        model = ShippedModel(**facts)
        models.append(model)
        if text is not None:
            cards[card] = _with_facts(card, text, model)
    for card, text in cards.items():
        _replace_file(card, text)
    manifest = folder / _MANIFEST
    content = {"models": [asdict(model) for model in models]}
    _replace_file(manifest, json.dumps(content, indent=2, ensure_ascii=False) + "\n")
    return manifest


def update_manifest(folder: Path, entries: Sequence[Mapping[str, str]]) -> Path:
    """Write some networks into the manifest of ``folder``, and keep its other ones.

    Args:
        folder: see :func:`write_manifest`; a folder without a manifest gets one.
        entries: as :func:`write_manifest` takes them. An entry replaces that of the same name.

    Raises:
        PerceptionError: as :func:`write_manifest`.
    """
    known = shipped_models(folder) if (folder / _MANIFEST).exists() else ()
    told = ("name", "licence", "input", "summary", "training_domain")
    new = {entry["name"]: entry for entry in entries}
    kept = {model.name: {key: str(getattr(model, key)) for key in told} for model in known}
    return write_manifest(folder, list({**kept, **new}.values()))


def _with_facts(card: Path, text: str, model: ShippedModel) -> str:
    """Return the text of a card with the facts of the manifest's entry."""
    for fact in ("sha256", "size_bytes", "licence", "input", "training_domain"):
        # A backslash in the replacement must not start a group reference.
        line = f"- {fact}: {getattr(model, fact)}".replace("\\", r"\\")
        text, count = re.subn(rf"^- {fact}: .*$", line, text, flags=re.MULTILINE)
        if count != 1:
            raise PerceptionError(f"{card} must have one line '- {fact}: …', got {count}")
    return text


def _digest(path: Path) -> tuple[str, int]:
    content = path.read_bytes()
    return hashlib.sha256(content).hexdigest(), len(content)


def _replace_file(path: Path, text: str) -> None:
    partial = path.with_name(path.name + ".part")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)
