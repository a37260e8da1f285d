"""The shipped networks and their manifest: content, refusals and writing."""

from __future__ import annotations

import hashlib
import json
import math
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from paths import ROOT

from perception import Camera, PerceptionError
from perception.networks import OnnxSettings
from perception.shipped import (
    DETECTOR,
    HEAD,
    LEGS,
    POSE,
    ShippedModel,
    detector_input_size,
    load_shipped,
    shipped_detector,
    shipped_head_pose_estimator,
    shipped_model_path,
    shipped_models,
    shipped_pose_estimator,
    update_manifest,
    verify_shipped_model,
    write_manifest,
)

FOLDER = ROOT / "perception" / "models"
NAMES = (DETECTOR, POSE, HEAD, LEGS)
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


@pytest.fixture
def copy(tmp_path):
    """Return a copy of the folder of the shipped networks."""
    return Path(shutil.copytree(FOLDER, tmp_path / "copy"))


# --- content ------------------------------------------------------------------------------------


def test_three_networks_are_shipped_and_small():
    models = shipped_models()
    assert tuple(model.name for model in models) == NAMES
    assert sum(model.size_bytes for model in models) <= 20e6
    assert {model.licence for model in models} == {"Apache-2.0"}


@pytest.mark.parametrize("name", NAMES)
def test_the_file_the_manifest_and_the_card_agree(name):
    (model,) = (each for each in shipped_models() if each.name == name)
    content = verify_shipped_model(name).read_bytes()
    assert (hashlib.sha256(content).hexdigest(), len(content)) == (model.sha256, model.size_bytes)
    card = (FOLDER / f"{name}.md").read_text(encoding="utf-8")
    for fact in ("sha256", "size_bytes", "licence", "input"):
        assert re.findall(rf"^- {fact}: (.+)$", card, re.MULTILINE) == [str(getattr(model, fact))]
    assert re.findall(r"^## (.+)$", card, re.MULTILINE) == [
        *("File", "Data", "Recipe", "Figures", "Limits"),
    ]
    assert "Made for the simulator" in card


def test_no_other_file_is_shipped():
    expected = {"manifest.json"}
    expected |= {f"{name}.{suffix}" for name in NAMES for suffix in ("onnx", "md")}
    assert {path.name for path in FOLDER.iterdir() if path.suffix != ".part"} == expected


def test_each_network_loads_in_its_estimator():
    for make in (shipped_detector, shipped_pose_estimator, shipped_head_pose_estimator):
        assert make() is not None


@pytest.mark.parametrize("name", [POSE, HEAD])
@pytest.mark.parametrize("people", [1, 2, 3, 7])
def test_a_batch_may_have_any_number_of_people(name, people):
    model = load_shipped(name)
    (tensor,) = model.inputs
    assert tensor.shape[0] is None
    crops = np.zeros((people, *tensor.shape[1:]), tensor.dtype)
    for output in model.run({tensor.name: crops}):
        assert len(output) == people
        assert np.isfinite(output).all()


@given(
    width=st.integers(160, 4000),
    height=st.integers(120, 3000),
    fov_deg=st.floats(20.0, 150.0),
)
def test_people_are_as_large_in_the_detector_as_with_a_60_degree_camera_at_448(
    width, height, fov_deg
):
    camera = Camera.from_fov(width, height, math.radians(fov_deg))
    input_height, input_width = detector_input_size(camera)
    assert input_height % 32 == input_width % 32 == 0
    scale = min(input_width / width, input_height / height)
    fitting = min(320 / width, 256 / height)
    assert scale >= fitting * (1.0 - 1e-6)
    enough = scale * camera.fx_px >= 224.0 / math.tan(math.radians(30.0)) * (1.0 - 1e-6)
    # Sides grow by a factor of at most 2.
    assert enough or scale >= 2.0 * fitting * (1.0 - 1e-6)


# --- refusals -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_an_altered_file_is_refused_with_both_hashes_and_the_remedy(copy, name):
    path = copy / f"{name}.onnx"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    expected = verify_shipped_model(name, FOLDER).read_bytes()
    with pytest.raises(PerceptionError) as refused:
        load_shipped(name, folder=copy)
    for part in (
        str(path),
        hashlib.sha256(content).hexdigest(),
        hashlib.sha256(expected).hexdigest(),
        "pip install --force-reinstall",
    ):
        assert part in str(refused.value)


def test_a_truncated_file_is_refused(copy):
    path = copy / f"{DETECTOR}.onnx"
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(PerceptionError, match=r"altered.*\(1000 bytes\)"):
        load_shipped(DETECTOR, folder=copy)


def test_a_missing_file_is_refused(copy):
    (copy / f"{HEAD}.onnx").unlink()
    with pytest.raises(PerceptionError, match=r"head_pose\.onnx is missing.*pip install"):
        load_shipped(HEAD, folder=copy)
    with pytest.raises(PerceptionError, match="is missing"):
        shipped_model_path(HEAD, copy)


def test_a_missing_provider_does_not_blame_the_file():
    with pytest.raises(PerceptionError, match="provider") as refused:
        load_shipped(DETECTOR, OnnxSettings(providers=("tensorrt",)))
    assert "altered" not in str(refused.value)


def test_an_unknown_name_is_refused_with_the_known_names():
    with pytest.raises(PerceptionError, match=r"'face'.*'person_detector'"):
        load_shipped("face")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        '{"models": 3}',
        '{"models": [3]}',
        '{"models": [{"name": "thing"}]}',
        json.dumps({"models": [{"name": "../up", "sha256": "0" * 64, "size_bytes": 1}]}),
    ],
)
def test_an_invalid_manifest_is_refused(tmp_path, text):
    (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(PerceptionError, match=r"manifest\.json"):
        shipped_models(tmp_path)


def test_a_missing_manifest_is_refused(tmp_path):
    with pytest.raises(PerceptionError, match=r"cannot be read.*pip install"):
        shipped_models(tmp_path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": "../up"}, "name must match"),
        ({"name": ""}, "needs all of its texts"),
        ({"licence": None}, "needs all of its texts"),
        ({"sha256": "abc"}, "64 lower-case hexadecimal"),
        ({"sha256": "G" * 64}, "64 lower-case hexadecimal"),
        ({"size_bytes": 0}, "size_bytes must be"),
        ({"size_bytes": "7"}, "size_bytes must be"),
        ({"training_domain": "dreams"}, "training_domain must be one of 'renders'"),
    ],
)
def test_entries_with_invalid_fields_are_refused(change, message):
    good = {
        "name": "thing",
        "sha256": "0" * 64,
        "size_bytes": 7,
        "licence": "Apache-2.0",
        "input": "1×3×8×8",
        "summary": "Does.",
        "training_domain": "renders",
    }
    ShippedModel(**good)
    with pytest.raises(PerceptionError, match=message):
        ShippedModel(**(good | change))


# --- writing ------------------------------------------------------------------------------------

ENTRY = {
    "name": "thing",
    "licence": "Apache-2.0",
    "input": "1×3×8×8",
    "summary": "Does one thing.",
    "training_domain": "renders",
}


def test_the_manifest_and_the_card_are_written_from_the_file(folder):
    digest = hashlib.sha256(b"weights").hexdigest()
    write_manifest(folder, [ENTRY])
    assert shipped_models(folder) == (
        ShippedModel("thing", digest, 7, "Apache-2.0", "1×3×8×8", "Does one thing.", "renders"),
    )
    card = (folder / "thing.md").read_text(encoding="utf-8")
    assert f"- sha256: {digest}\n- size_bytes: 7\n- licence: Apache-2.0\n- input: 1×3×8×8" in card
    assert card.replace(digest, "not exported yet").replace("7", "not exported yet") == CARD
    first = (folder / "thing.md").read_bytes(), (folder / "manifest.json").read_bytes()
    write_manifest(folder, [ENTRY])
    assert first == ((folder / "thing.md").read_bytes(), (folder / "manifest.json").read_bytes())
    (folder / "thing.onnx").write_bytes(b"other weights")
    with pytest.raises(PerceptionError, match="altered"):
        verify_shipped_model("thing", folder)
    write_manifest(folder, [ENTRY])
    assert verify_shipped_model("thing", folder) == folder / "thing.onnx"


def test_the_manifest_is_written_without_a_card(folder):
    (folder / "thing.md").unlink()
    write_manifest(folder, [ENTRY])
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
        write_manifest(folder, [ENTRY])
    assert not (folder / "manifest.json").exists()


def test_nothing_is_written_for_a_missing_file(folder):
    before = (folder / "thing.md").read_bytes()
    with pytest.raises(PerceptionError, match=r"cannot read .*other\.onnx"):
        write_manifest(folder, [ENTRY, ENTRY | {"name": "other"}])
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
