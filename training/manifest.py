"""Writing the manifest of the shipped networks, and its facts into their cards."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from perception import PerceptionError
from perception.shipped import ShippedModel, shipped_models

_MANIFEST: Final = "manifest.json"
# What an entry says; size and SHA-256 are those of the file.
_TOLD: Final = ("name", "licence", "input", "summary", "training_domain")


def update_manifest(folder: Path, entries: Sequence[Mapping[str, str]]) -> Path:
    """Write networks into the manifest of ``folder``, keep its others, and fill in their cards.

    Args:
        folder: folder with ``name.onnx`` of each entry; one without a manifest gets one. In a card
            ``name.md``, if there is one, the lines that begin with ``- sha256:``,
            ``- size_bytes:``, ``- licence:``, ``- input:`` and ``- training_domain:`` are
            replaced; each must occur once.
        entries: ``name``, ``licence``, ``input``, ``summary`` and ``training_domain`` of each
            network; size and SHA-256 are computed from the file. An entry replaces that of the
            same name.

    Returns:
        The path of the manifest. Each file is replaced as a whole, the manifest last.

    Raises:
        PerceptionError: for a missing file, or a card without one of the lines.
    """
    known = shipped_models(folder) if (folder / _MANIFEST).exists() else ()
    told = {each.name: {key: str(getattr(each, key)) for key in _TOLD} for each in known}
    models = []
    cards: dict[Path, str] = {}
    for entry in (told | {entry["name"]: dict(entry) for entry in entries}).values():
        path = folder / f"{entry['name']}.onnx"
        card = path.with_suffix(".md")
        try:
            content = path.read_bytes()
            text = card.read_text(encoding="utf-8") if card.exists() else None
        except OSError as cause:
            raise PerceptionError(f"cannot read {cause.filename}: {cause.strerror}") from cause
        facts: dict[str, Any] = {
            **entry,
            "sha256": hashlib.sha256(content).hexdigest(),
            "size_bytes": len(content),
        }
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


def _with_facts(card: Path, text: str, model: ShippedModel) -> str:
    """Return the text of a card with the facts of the manifest's entry."""
    for fact in ("sha256", "size_bytes", "licence", "input", "training_domain"):
        # A backslash in the replacement must not start a group reference.
        line = f"- {fact}: {getattr(model, fact)}".replace("\\", r"\\")
        text, count = re.subn(rf"^- {fact}: .*$", line, text, flags=re.MULTILINE)
        if count != 1:
            raise PerceptionError(f"{card} must have one line '- {fact}: …', got {count}")
    return text


def _replace_file(path: Path, text: str) -> None:
    partial = path.with_name(path.name + ".part")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)
