"""Contents, archives and stores that tests of the models command share."""

from __future__ import annotations

import hashlib
import io
import zipfile
from pathlib import Path

from model_server import ModelServer

from awarenav.models import Catalogue, ModelStore, RealModel

# Not a network, but enough to tell a complete file from half of it, and an old one from a new one.
CONTENT = bytes(range(256)) * 4000
OTHER = CONTENT[::-1]


def sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def zipped(**files: bytes) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name.replace("__", "/"), content)
    return buffer.getvalue()


def model(server: ModelServer, path: str, **changes: object) -> RealModel:
    facts = {
        "name": "tiny",
        "role": "detector",
        "url": server.url(path),
        "size_mb": 1.0,
        "licence": "Apache-2.0",
        "publisher": "nobody",
        "purpose": "tests",
    }
    return RealModel.model_validate(facts | changes)


def store(folder: Path, entry: RealModel) -> ModelStore:
    return ModelStore(folder, Catalogue(models=(entry,)))


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir() if not path.name.endswith(".lock")}
