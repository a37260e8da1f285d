"""Files that stand for networks, archives of them, and their entries in a catalogue."""

from __future__ import annotations

import hashlib
import io
import zipfile
from pathlib import Path

from awarenav.models import ModelStore
from perception.named import Catalogue, RealModel


def sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def zipped(files: dict[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def entry(name: str, content: bytes, *sources: dict[str, object], **changes: object) -> RealModel:
    """Return the entry of a network with this content."""
    facts = {
        "name": name,
        "role": "detector",
        "sources": sources,
        "sha256": sha256(content),
        "size_mb": 1.0,
        "licence": "Apache-2.0",
        "licence_page": "https://example.org/licence",
        "trained_on": "a few photographs",
        "publisher": "nobody",
        "purpose": "tests",
    }
    return RealModel.model_validate(facts | changes)


def store_of(folder: Path, *networks: RealModel) -> ModelStore:
    return ModelStore(folder, Catalogue(models=networks))


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()} if folder.exists() else set()
