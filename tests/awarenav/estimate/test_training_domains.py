"""Networks that have seen renders only are refused on other images, unless they are asked for."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import onnx
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numbered_images import CAMERA, numbered
from paths import SHARED

from awarenav.cli import main
from awarenav.errors import AwarenavError
from awarenav.estimate import choice_of_options
from perception import AwarenessPipeline, Camera, PerceptionError
from perception.named import (
    Catalogue,
    NetworkChoice,
    Networks,
    NetworkSet,
    admit_networks,
    choose_networks,
    default_networks,
)
from perception.networks import OnnxModel
from perception.shipped import DETECTOR, POSE, shipped_detector, shipped_model_path

PHOTOGRAPHS = sorted((SHARED / "images").glob("coco_*.jpg"))
ALL = ("detector", "pose", "head")


@pytest.fixture
def photograph(tmp_path: Path) -> Path:
    path = tmp_path / "photograph.png"
    assert cv2.imwrite(str(path), numbered(10))
    CAMERA.to_yaml(tmp_path / "camera.yaml")
    return path


def told(path: Path, domain: str | None) -> Path:
    """A copy of the shipped detector whose metadata name a domain."""
    model = onnx.load(str(shipped_model_path(DETECTOR)))
    # Only the shipped detector itself may leave the size of its images free.
    height, width = model.graph.input[0].type.tensor_type.shape.dim[2:]
    height.dim_value, width.dim_value = 256, 320
    others = {each.key: each.value for each in model.metadata_props}
    others.pop("training_domain", None)
    told_here = {} if domain is None else {"training_domain": domain}
    onnx.helper.set_model_props(model, others | told_here)
    onnx.save(model, str(path))
    return path


@pytest.mark.parametrize(
    ("domain", "known"),
    [("renders", "renders"), ("photographs", "photographs"), ("dreams", None), (None, None)],
)
def test_the_metadata_of_a_file_name_the_training_domain(tmp_path, domain, known):
    assert OnnxModel(told(tmp_path / "a.onnx", domain)).training_domain == known


def test_a_copy_of_a_shipped_network_is_recognised(tmp_path):
    copy = shutil.copy(shipped_model_path(POSE), tmp_path / "renamed.onnx")
    assert OnnxModel(copy).training_domain == "renders"
    assert OnnxModel(Path(copy).read_bytes()).training_domain == "renders"


@pytest.mark.parametrize(
    ("pose", "head", "roles"),
    [
        ("shipped", "auto", ("pose", "head")),
        ("shipped", "pnp", ("pose",)),
        ("shipped", "network", ("pose", "head")),
    ],
)
def test_one_network_of_three_is_enough_to_be_refused(tmp_path, pose, head, roles):
    detector = told(tmp_path / "a.onnx", "photographs")
    networks = choose_networks(str(detector), pose, head)
    assert networks.training_domains["detector"] == "photographs"
    assert admit_networks(networks, rendered=True, allowed=False) == ()
    assert admit_networks(networks, rendered=False, allowed=True) == roles
    with pytest.raises(AwarenavError, match="renders only") as refusal:
        admit_networks(networks, rendered=False, allowed=False)
    assert all(role in str(refusal.value) for role in roles)
    assert "detector" not in str(refusal.value)
    assert "awarenav models fetch real" in str(refusal.value)


def test_a_photograph_is_refused_in_one_line_and_nothing_is_written(photograph, capsys):
    out = photograph.with_name("out.jsonl")
    assert main(["estimate", str(photograph), "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert len(said.splitlines()) == 1
    assert "the detector, pose and head networks have seen renders only" in said
    assert not out.exists()


def test_asked_for_they_are_named_on_stderr_and_in_every_line(photograph, capsys):
    out = photograph.with_name("out.jsonl")
    given = [str(photograph), "--out", str(out), "--allow-simulator-networks"]
    assert main(["estimate", *given]) == 0
    assert "renders only" in capsys.readouterr().err
    (line,) = map(json.loads, out.read_text().splitlines())
    assert tuple(line["simulator_networks"]) == ALL


def test_renders_of_this_package_are_admitted_and_others_beside_them_are_not(tmp_path, capsys):
    folder = tmp_path / "set"
    folder.mkdir()
    frames = [f"{number:06d}.png" for number in range(2)]
    for number, name in enumerate(frames):
        assert cv2.imwrite(str(folder / name), numbered(number))
    lines = [
        {"frame": name, "stamp_s": 0.0, "T_odom_camera": None, "people": []} for name in frames
    ]
    (folder / "truth.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    (folder / "render.yaml").write_text("frames: 2\n")
    CAMERA.to_yaml(folder / "camera.yaml")
    out = tmp_path / "out.jsonl"
    assert main(["estimate", str(folder), "--out", str(out)]) == 0
    assert "renders only" not in capsys.readouterr().err
    assert all(
        "simulator_networks" not in json.loads(line) for line in out.read_text().splitlines()
    )
    assert cv2.imwrite(str(folder / "holiday.png"), np.zeros((64, 64, 3), np.uint8))
    assert main(["estimate", str(folder), "--out", str(out), "--overwrite"]) == 2
    (folder / "holiday.png").unlink()
    (folder / "render.yaml").unlink()
    assert main(["estimate", str(folder), "--out", str(out), "--overwrite"]) == 2


def test_a_file_names_the_networks(photograph, capsys):
    file = photograph.with_name("networks.yaml")
    detector = told(photograph.with_name("a.onnx"), "photographs")
    file.write_text(f"detector: {detector}\nhead: pnp\n")
    assert NetworkChoice.from_yaml(file) == NetworkChoice(detector=str(detector), head="pnp")
    given = ["estimate", str(photograph), "--networks", str(file)]
    assert main([*given, "--out", str(photograph.with_name("a.jsonl"))]) == 2
    assert "the pose network has seen renders only" in capsys.readouterr().err
    assert main([*given, "--pose", "mediapipe"]) == 2
    assert "--pose and --networks exclude each other" in capsys.readouterr().err
    file.write_text("poze: shipped\n")
    assert main(given) == 2
    assert "did you mean 'pose'" in capsys.readouterr().err


def catalogue_of(detector: Path, pose: Path) -> Catalogue:
    """A catalogue with a set 'real' of a detector and a pose network."""
    some = next(each for each in Catalogue.shipped().models if each.file.endswith(".onnx"))
    models = tuple(
        some.model_copy(
            update={
                "name": file.stem,
                "role": role,
                "sha256": hashlib.sha256(file.read_bytes()).hexdigest(),
                "publisher": "Example",
            }
        )
        for role, file in (("detector", detector), ("pose", pose))
    )
    names = {"detector": detector.stem, "pose": pose.stem, "head": "pnp"}
    return Catalogue(models=models, sets=(NetworkSet(name="real", purpose="tests", **names),))


@pytest.fixture
def real_set(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the fetched set 'real', in a catalogue of its own."""
    folder = tmp_path / "fetched"
    folder.mkdir()
    files = told(folder / "people.onnx", None), folder / "points.onnx"
    pose = onnx.load(str(shipped_model_path(POSE)))
    pose.doc_string = "not the shipped one to the byte"
    del pose.metadata_props[:]
    onnx.save(pose, str(files[1]))
    catalogue = catalogue_of(*files)
    monkeypatch.setattr(Catalogue, "shipped", classmethod(lambda cls: catalogue))
    monkeypatch.setenv("AWARENAV_MODELS", str(folder))
    return folder


def test_a_catalogued_file_is_known_by_its_content(real_set, tmp_path):
    renamed = Path(shutil.copy(real_set / "people.onnx", tmp_path / "mine.onnx"))
    choice = NetworkChoice(detector=f"ultralytics:{renamed}", pose="points", head="pnp")
    assert {role: each.name for role, each in choice.catalogued().items()} == {
        "detector": "people",
        "pose": "points",
    }
    domains = choose_networks(**choice.model_dump()).training_domains
    assert domains == {"detector": "photographs", "pose": "photographs"}
    renamed.write_bytes(told(tmp_path / "other.onnx", "dreams").read_bytes())
    assert set(choice.catalogued()) == {"pose"}
    assert choose_networks(**choice.model_dump()).training_domains["detector"] is None


def test_photographs_get_the_fetched_set_and_one_line_says_so(real_set, photograph, capsys):
    given = ["estimate", str(photograph), "--out", str(photograph.with_name("out.jsonl"))]
    assert main(given) == 0
    said = [line for line in capsys.readouterr().err.splitlines() if "set real" in line]
    assert said == [
        "awarenav estimate: networks of the fetched set real: detector people, pose points, head "
        "pnp"
    ]
    (line,) = map(json.loads, photograph.with_name("out.jsonl").read_text().splitlines())
    assert "simulator_networks" not in line
    # An option counts before the set, and whoever allows networks of renders gets them.
    assert main([*given, "--overwrite", "--pose", "shipped"]) == 2
    assert "the pose network has seen renders only" in capsys.readouterr().err
    assert main([*given, "--overwrite", "--allow-simulator-networks"]) == 0
    assert "the detector, pose and head networks have seen renders only" in capsys.readouterr().err
    # Half a set is none.
    (real_set / "points.onnx").unlink()
    assert main([*given, "--overwrite"]) == 2
    assert "awarenav models fetch real" in capsys.readouterr().err


def test_renders_keep_the_shipped_networks(real_set):
    options = SimpleNamespace(networks=None)
    assert choice_of_options(options, rendered=True) == NetworkChoice()
    chosen = choice_of_options(options, rendered=False)
    assert (chosen.detector, chosen.pose, chosen.head) == ("people", "points", "pnp")


def test_small_faces_are_looked_for_only_if_their_network_is_named(tmp_path, monkeypatch):
    with pytest.raises(AwarenavError, match="give --face too"):
        choose_networks(small_face="retinaface-mobilenet")
    monkeypatch.setenv("AWARENAV_MODELS", str(tmp_path))
    for model in Catalogue.shipped().models:
        (tmp_path / model.file).touch()
    chosen = NetworkChoice.default(simulator=False)
    assert (chosen.face, chosen.small_face) == ("face-mesh", "none")


def camera_of(photograph: Path) -> tuple[np.ndarray, Camera]:
    image_rgb = cv2.cvtColor(cv2.imread(str(photograph)), cv2.COLOR_BGR2RGB)
    height, width = image_rgb.shape[:2]
    return image_rgb, Camera.from_fov(width, height, np.radians(60.0))


@pytest.mark.skipif(not PHOTOGRAPHS, reason="no photographs beside the checkout")
def test_the_library_refuses_photographs_as_the_commands_do(tmp_path, capsys):
    for path in PHOTOGRAPHS:
        assert main(["estimate", str(path), "--out", str(tmp_path / "out.jsonl")]) == 2
        _, camera = camera_of(path)
        with pytest.raises(PerceptionError, match="renders only") as refusal:
            AwarenessPipeline(camera)
        # One sentence, but for the word that allows them.
        said = capsys.readouterr().err.removeprefix("awarenav estimate: ")
        assert str(refusal.value).partition(" (or ")[0] in " ".join(said.split())
        assert "`awarenav models fetch real`" in str(refusal.value)
        assert "simulator_networks=True" in str(refusal.value)


def test_the_library_gives_the_simulator_the_shipped_networks(real_set):
    image_rgb = np.full((CAMERA.height_px, CAMERA.width_px, 3), 120, np.uint8)
    assert AwarenessPipeline(CAMERA, simulator_networks=True).process(image_rgb, 0.0) == ()
    networks = default_networks(simulator_networks=True)
    assert tuple(networks.training_domains) == ALL
    assert set(networks.training_domains.values()) == {"renders"}
    with pytest.raises(PerceptionError, match="pose_estimator is missing"):
        AwarenessPipeline(CAMERA, shipped_detector, simulator_networks=True)


def test_the_library_uses_the_fetched_set(real_set):
    image_rgb = np.full((CAMERA.height_px, CAMERA.width_px, 3), 120, np.uint8)
    assert AwarenessPipeline(CAMERA).process(image_rgb, 0.0) == ()
    domains = default_networks(simulator_networks=False).training_domains
    assert domains == {"detector": "photographs", "pose": "photographs"}
    (real_set / "points.onnx").unlink()  # half a set is none
    with pytest.raises(PerceptionError, match="awarenav models fetch real"):
        AwarenessPipeline(CAMERA)


@given(
    domains=st.dictionaries(
        st.sampled_from(["detector", "pose", "head", "face"]),
        st.sampled_from(["renders", "photographs", None]),
    ),
    rendered=st.booleans(),
    allowed=st.booleans(),
)
def test_networks_of_renders_see_no_other_pictures_unasked(domains, rendered, allowed):
    networks = Networks(None, None, training_domains=domains)
    unfit = tuple(role for role, domain in domains.items() if domain == "renders")
    if unfit and not rendered and not allowed:
        with pytest.raises(PerceptionError, match="renders only"):
            admit_networks(networks, rendered=rendered, allowed=allowed)
    else:
        admitted = admit_networks(networks, rendered=rendered, allowed=allowed)
        assert admitted == (() if rendered else unfit)
