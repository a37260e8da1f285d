"""Networks of the user: messages advise options that the commands have, and these work."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import onnx
import pytest
from numbered_images import CAMERA, numbered
from onnx import TensorProto, helper, numpy_helper

from awarenav.cli import main
from awarenav.errors import AwarenavError
from perception import PerceptionError
from perception.named import NetworkChoice, choose_networks

COMMANDS = ("estimate", "bridge", "doctor")
SQUARE = (1, 3, 640, 640)


def network(
    path: Path, shape: tuple[int | str, ...], names: str | None = None, **outputs: np.ndarray
) -> Path:
    """Write a network that returns the same numbers for every image."""
    kinds = {each: helper.np_dtype_to_tensor_dtype(array.dtype) for each, array in outputs.items()}
    graph = helper.make_graph(
        [helper.make_node("Identity", [f"{each}_numbers"], [each]) for each in outputs],
        "graph",
        [helper.make_tensor_value_info("images", TensorProto.FLOAT, shape)],
        [
            helper.make_tensor_value_info(each, kinds[each], array.shape)
            for each, array in outputs.items()
        ],
        [numpy_helper.from_array(array, f"{each}_numbers") for each, array in outputs.items()],
    )
    opset = helper.make_opsetid("", 17)
    model = helper.make_model(graph, opset_imports=[opset], ir_version=8)
    if names is not None:
        helper.set_model_props(model, {"names": names})
    onnx.save(model, str(path))
    return path


def zeros(*shape: int) -> np.ndarray:
    return np.zeros(shape, np.float32)


def two_classes(path: Path) -> Path:
    return network(path, SQUARE, "{0: 'forklift', 1: 'pedestrian'}", out=zeros(1, 6, 8400))


def free(path: Path) -> Path:
    return network(path, ("n", 3, "h", "w"), out=zeros(1, 84, 8400))


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    assert cv2.imwrite(str(tmp_path / "a.png"), numbered(3))
    CAMERA.to_yaml(tmp_path / "camera.yaml")
    return tmp_path / "a.png"


def said(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str]:
    status = main(["estimate", *map(str, arguments)])
    return status, capsys.readouterr().err


def options_of(command: str, capsys: pytest.CaptureFixture[str]) -> set[str]:
    with pytest.raises(SystemExit):
        raise SystemExit(main([command, "--help"]))
    return set(re.findall(r"--[a-z-]+", capsys.readouterr().out))


@pytest.mark.parametrize(
    ("make", "given", "advice"),
    [
        (two_classes, (), "'pedestrian'; give the number of the class with --person-class"),
        (two_classes, ("--person-class", 2), r"--person-class must lie in \[0, 1\]"),
        (free, (), "give it with --input-size WxH in pixels"),
        (two_classes, ("--person-class", 1, "--input-size", "320x640"), "got 640 x 320"),
        (free, ("--input-size", "640"), "--input-size must be WxH in pixels, as 640x480, got"),
        (None, ("--person-class", 0), "are for a --detector of your own"),
    ],
)
def test_advice_for_a_detector_names_options_of_all_commands(
    tmp_path, picture, capsys, make, given, advice
) -> None:
    detector = "shipped" if make is None else make(tmp_path / "n.onnx")
    out = ["--out", tmp_path / "o.jsonl", "--allow-simulator-networks"]
    status, text = said(capsys, picture, "--detector", detector, *given, *out)
    assert status == 2
    assert re.search(advice, text)
    assert not re.search(r"person_class|input_size_hw_px", text)
    for command in COMMANDS:
        assert set(re.findall(r"--[a-z-]+", advice)) <= options_of(command, capsys)


@pytest.mark.parametrize(
    ("make", "given"),
    [(two_classes, ("--person-class", 1)), (free, ("--input-size", "640x640"))],
)
def test_the_advice_works(tmp_path, picture, capsys, make, given) -> None:
    detector = make(tmp_path / "n.onnx")
    out = ["--out", tmp_path / "o.jsonl", "--allow-simulator-networks"]
    assert said(capsys, picture, "--detector", detector, *given, *out)[0] == 0
    # The file of --networks takes the same.
    named = dict(zip([given[0][2:].replace("-", "_")], given[1:], strict=True))
    choice = NetworkChoice(detector=str(detector), **named)
    choice.to_yaml(tmp_path / "networks.yaml")
    assert NetworkChoice.from_yaml(tmp_path / "networks.yaml") == choice
    # An option completes a file that does not say it.
    NetworkChoice(detector=str(detector)).to_yaml(tmp_path / "networks.yaml")
    arguments = ["--networks", tmp_path / "networks.yaml", "--overwrite", *out]
    assert said(capsys, picture, *arguments)[0] == 2
    assert said(capsys, picture, *arguments, *given)[0] == 0


def test_a_pose_network_of_free_size_has_advice_that_can_be_taken(
    tmp_path, picture, capsys
) -> None:
    pose = network(tmp_path / "p.onnx", ("n", 3, "h", "w"), out=zeros(1, 133, 576))
    out = ["--out", tmp_path / "o.jsonl", "--allow-simulator-networks"]
    status, text = said(capsys, picture, "--pose", pose, *out)
    assert status == 2
    assert "export it with a fixed size" in text
    assert "input_size" not in text


@pytest.fixture
def unnamed(tmp_path: Path) -> Path:
    """A detector with the outputs dets and labels, and no name that tells its family."""
    labels = np.zeros((1, 1), np.int64)
    return network(tmp_path / "end2end.onnx", (1, 3, 64, 64), dets=zeros(1, 1, 5), labels=labels)


def test_a_prefix_tells_it_and_another_or_none_is_refused(unnamed: Path) -> None:
    for family, layout in (("rtmdet", "RTMDet"), ("yolox", "YOLOX with NMS")):
        networks = choose_networks(f"{family}:{unnamed}", "shipped", "pnp")
        assert networks.detector.layout == layout  # type: ignore[union-attr]
    for prefix, error, message in (
        ("", PerceptionError, "--detector rtmdet:FILE or yolox:FILE"),
        ("ultralytics:", PerceptionError, "--detector rtmdet:FILE or yolox:FILE"),
        ("yolo:", AwarenavError, "there is no file 'yolo:"),
    ):
        with pytest.raises(error, match=message):
            choose_networks(f"{prefix}{unnamed}", "shipped", "pnp")
