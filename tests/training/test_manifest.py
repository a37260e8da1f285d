"""Writing the manifest of the shipped networks."""

from __future__ import annotations

import hashlib

import pytest

from perception import PerceptionError
from perception.shipped import ShippedModel, shipped_models, verify_shipped_model
from training.manifest import update_manifest

CARD = """# Something

Does one thing. More about it.

- sha256: not exported yet
- size_bytes: not exported yet
- licence: Apache-2.0
- input: 1×3×8×8
- training_domain: renders

## Limits
"""


@pytest.fixture
def folder(tmp_path):
    """Return a folder with one file in place of a network, and its card."""
    (tmp_path / "thing.onnx").write_bytes(b"weights")
    (tmp_path / "thing.md").write_text(CARD, encoding="utf-8")
    return tmp_path


ENTRY = {
    "name": "thing",
    "licence": "Apache-2.0",
    "input": "1×3×8×8",
    "summary": "Does one thing.",
    "training_domain": "renders",
}


def test_the_manifest_and_the_card_are_written_from_the_file(folder):
    digest = hashlib.sha256(b"weights").hexdigest()
    update_manifest(folder, [ENTRY])
    assert shipped_models(folder) == (
        ShippedModel("thing", digest, 7, "Apache-2.0", "1×3×8×8", "Does one thing.", "renders"),
    )
    card = (folder / "thing.md").read_text(encoding="utf-8")
    assert f"- sha256: {digest}\n- size_bytes: 7\n- licence: Apache-2.0\n- input: 1×3×8×8" in card
    assert card.replace(digest, "not exported yet").replace("7", "not exported yet") == CARD
    first = (folder / "thing.md").read_bytes(), (folder / "manifest.json").read_bytes()
    update_manifest(folder, [ENTRY])
    assert first == ((folder / "thing.md").read_bytes(), (folder / "manifest.json").read_bytes())
    (folder / "thing.onnx").write_bytes(b"other weights")
    with pytest.raises(PerceptionError, match="altered"):
        verify_shipped_model("thing", folder)
    update_manifest(folder, [ENTRY])
    assert verify_shipped_model("thing", folder) == folder / "thing.onnx"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("- sha256: not exported yet\n", "", "one line '- sha256: …', got 0"),
        ("- licence: Apache-2.0", "- licence: MIT\n- licence: Apache-2.0", "got 2"),
    ],
)
def test_nothing_is_written_for_a_card_without_the_lines(folder, old, new, message):
    (folder / "thing.md").write_text(CARD.replace(old, new), encoding="utf-8")
    with pytest.raises(PerceptionError, match=message):
        update_manifest(folder, [ENTRY])
    assert not (folder / "manifest.json").exists()


def test_nothing_is_written_for_a_missing_file(folder):
    before = (folder / "thing.md").read_bytes()
    with pytest.raises(PerceptionError, match=r"cannot read .*other\.onnx"):
        update_manifest(folder, [ENTRY, ENTRY | {"name": "other"}])
    assert (folder / "thing.md").read_bytes() == before
    assert not (folder / "manifest.json").exists()


def test_training_one_network_keeps_the_others_in_the_manifest(folder):
    (folder / "other.onnx").write_bytes(b"other weights")
    assert update_manifest(folder, [ENTRY]).is_file()
    update_manifest(folder, [ENTRY | {"name": "other"}])
    (folder / "thing.onnx").write_bytes(b"new weights")
    update_manifest(folder, [ENTRY | {"summary": "Does it better."}])
    thing, other = shipped_models(folder)
    assert (thing.name, other.name) == ("thing", "other")
    assert thing.summary == "Does it better."
    assert thing.sha256 == hashlib.sha256(b"new weights").hexdigest()
    assert other.sha256 == hashlib.sha256(b"other weights").hexdigest()
