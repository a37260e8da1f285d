"""The shipped networks and their manifest: content and refusals."""

from __future__ import annotations

import hashlib
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
from perception.networks import OnnxModel, OnnxSettings
from perception.shipped import (
    DETECTOR,
    HEAD,
    LEGS,
    POSE,
    detector_input_size,
    shipped_model_path,
    shipped_models,
    verify_shipped_model,
)

FOLDER = ROOT / "perception" / "models"
NAMES = (DETECTOR, POSE, HEAD, LEGS)


@pytest.fixture
def copy(tmp_path):
    """Return a copy of the folder of the shipped networks."""
    return Path(shutil.copytree(FOLDER, tmp_path / "copy"))


# --- content ------------------------------------------------------------------------------------


def test_four_networks_are_shipped_small_and_alone():
    models = shipped_models()
    assert tuple(model.name for model in models) == NAMES
    assert sum(model.size_bytes for model in models) <= 20e6
    assert {model.licence for model in models} == {"Apache-2.0"}
    expected = {"manifest.json"}
    expected |= {f"{name}.{suffix}" for name in NAMES for suffix in ("onnx", "md")}
    assert {path.name for path in FOLDER.iterdir() if path.suffix != ".part"} == expected


@pytest.mark.parametrize("name", NAMES)
def test_the_file_the_manifest_and_the_card_agree(name):
    (model,) = (each for each in shipped_models() if each.name == name)
    content = verify_shipped_model(name).read_bytes()
    assert (hashlib.sha256(content).hexdigest(), len(content)) == (model.sha256, model.size_bytes)
    card = (FOLDER / f"{name}.md").read_text(encoding="utf-8")
    assert model.training_domain in ("renders", "simulated scans")
    assert OnnxModel.shipped(name).training_domain == model.training_domain
    for fact in ("sha256", "size_bytes", "licence", "input", "training_domain"):
        assert re.findall(rf"^- {fact}: (.+)$", card, re.MULTILINE) == [str(getattr(model, fact))]
    assert re.findall(r"^## (.+)$", card, re.MULTILINE) == [
        *("File", "Data", "Recipe", "Figures", "Limits"),
    ]
    assert "Made for the simulator" in card


@pytest.mark.parametrize("name", [POSE, HEAD])
@pytest.mark.parametrize("people", [1, 7])
def test_a_batch_may_have_any_number_of_people(name, people):
    model = OnnxModel.shipped(name)
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


def test_an_altered_file_is_refused_with_both_hashes_and_the_remedy(copy):
    path = copy / f"{HEAD}.onnx"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    expected = verify_shipped_model(HEAD, FOLDER).read_bytes()
    with pytest.raises(PerceptionError) as refused:
        OnnxModel.shipped(HEAD, folder=copy)
    for part in (
        str(path),
        hashlib.sha256(content).hexdigest(),
        hashlib.sha256(expected).hexdigest(),
        "pip install --force-reinstall",
    ):
        assert part in str(refused.value)


def test_a_missing_file_is_refused_and_a_missing_provider_does_not_blame_it(copy):
    (copy / f"{HEAD}.onnx").unlink()
    with pytest.raises(PerceptionError, match=r"head_pose\.onnx is missing.*pip install"):
        OnnxModel.shipped(HEAD, folder=copy)
    with pytest.raises(PerceptionError, match="is missing"):
        shipped_model_path(HEAD, copy)
    with pytest.raises(PerceptionError, match="provider") as refused:
        OnnxModel.shipped(DETECTOR, OnnxSettings(providers=("tensorrt",)))
    assert "altered" not in str(refused.value)


@pytest.mark.parametrize(
    "text",
    ["", "{}", '{"models": [{"name": "thing"}]}'],
)
def test_an_invalid_manifest_is_refused(tmp_path, text):
    (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(PerceptionError, match=r"manifest\.json"):
        shipped_models(tmp_path)
    (tmp_path / "manifest.json").unlink()
    with pytest.raises(PerceptionError, match=r"cannot be read.*pip install"):
        shipped_models(tmp_path)
