"""Loading and running ONNX models: checks, refusals and their messages."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import onnx
import onnxruntime as ort
import pytest
from onnx_graphs import fixed, red_point_pose

from perception import PerceptionError
from perception.networks import (
    NETWORK_TIME,
    PROVIDERS,
    OnnxModel,
    OnnxPoseEstimator,
    OnnxSettings,
    parse_provider_options,
)
from perception.networks._tflite import TfliteModel

ROWS = np.arange(12.0).reshape(1, 2, 6)


def content() -> bytes:
    return fixed({"out": ROWS}, (32, 64), metadata={"names": "{0: 'person'}"}, batch="N")


def test_a_model_describes_inputs_outputs_metadata_and_provider() -> None:
    model = OnnxModel(content())
    assert [(t.name, t.shape, t.dtype) for t in model.inputs] == [
        ("images", (None, 3, 32, 64), "float32")
    ]
    assert [(t.name, t.shape, t.dtype) for t in model.outputs] == [("out", (1, 2, 6), "float32")]
    assert model.metadata == {"names": "{0: 'person'}"}
    assert model.providers == ("cpu",)
    assert model.path is None
    assert "images (any, 3, 32, 64) float32 -> out (1, 2, 6) float32" in repr(model)


def test_outputs_come_in_the_order_of_the_graph(tmp_path: Path) -> None:
    path = tmp_path / "model.onnx"
    path.write_bytes(fixed({"b": ROWS, "a": np.array([[3]])}, (32, 64)))
    model = OnnxModel(path)
    assert model.path == path
    first, second = model.run({"images": np.zeros((1, 3, 32, 64), np.float32)})
    np.testing.assert_array_equal(first, ROWS)
    np.testing.assert_array_equal(second, [[3]])


def test_the_sha256_of_the_file_is_checked(tmp_path: Path) -> None:
    path = tmp_path / "model.onnx"
    path.write_bytes(content())
    digest = hashlib.sha256(content()).hexdigest()
    assert OnnxModel(path, sha256=digest.upper()).path == path
    path.write_bytes(content() + b"\x00")
    with pytest.raises(PerceptionError, match=rf"model\.onnx is not the file.*wanted {digest}"):
        OnnxModel(path, sha256=digest)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("empty.onnx", r"empty\.onnx is not an ONNX network"),
        ("half.onnx", r"half\.onnx is not an ONNX network"),
        ("absent.onnx", "cannot read the model .*absent.onnx: No such file"),
        (".", "cannot read the model .*: Is a directory"),
        ("a\0b", "cannot read the model"),
        (3, "got int: 3"),
    ],
)
def test_anything_but_the_file_of_a_network_is_refused(
    tmp_path: Path, given: object, words: str
) -> None:
    (tmp_path / "empty.onnx").touch()
    (tmp_path / "half.onnx").write_bytes(content()[:-1])
    path = tmp_path / given if isinstance(given, str) else given
    with pytest.raises(PerceptionError, match=words):
        OnnxModel(path)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("start", "cure"),
    [
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 12\n", "git lfs pull"),
        (b"\n<!DOCTYPE html><html><body>404</body></html>", "download button"),
        (b'{"error": "Invalid username or password."}', "download button"),
        (b"PK\x03\x04" + b"\0" * 200, "export the network to ONNX"),
        (b"\x80\x02}q\x00.", "export the network to ONNX"),
        (b"\x1f\x8b\x08" + b"\0" * 50, "unpack it"),
        (b"\x89HDF\r\n\x1a\n" + b"\0" * 50, "export the network to ONNX"),
        (b"", "fetch it again"),
    ],
)
def test_a_file_that_is_often_taken_for_a_network_is_named_with_the_cure(
    tmp_path: Path, start: bytes, cure: str
) -> None:
    for suffix, load in ((".onnx", OnnxModel), (".tflite", TfliteModel)):
        path = tmp_path / f"network{suffix}"
        path.write_bytes(start)
        with pytest.raises(PerceptionError) as refused:
            load(path)
        assert cure in str(refused.value)
        assert "protobuf" not in str(refused.value).lower()


def test_without_litert_the_message_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ai_edge_litert.interpreter", None)
    with pytest.raises(PerceptionError, match="of the extra 'litert': pip install"):
        TfliteModel(b"\x1c\0\0\0TFL3" + bytes(99))


def test_weights_in_a_separate_file_are_loaded_only_without_a_sha256(tmp_path: Path) -> None:
    path = tmp_path / "model.onnx"
    values = np.full((1, 2000, 6), 0.5, np.float32)
    onnx.save_model(
        onnx.load_from_string(fixed({"out": values}, (32, 64))),
        str(path),
        save_as_external_data=True,
        location="weights.bin",
        size_threshold=100,
    )
    (out,) = OnnxModel(path).run({"images": np.zeros((1, 3, 32, 64), np.float32)})
    np.testing.assert_array_equal(out, values)
    with pytest.raises(PerceptionError, match="not an ONNX network"):
        OnnxModel(path, sha256=hashlib.sha256(path.read_bytes()).hexdigest())


@pytest.mark.parametrize("name", sorted(PROVIDERS))
def test_a_provider_starts_or_the_error_says_which_are_present(name: str) -> None:
    settings = OnnxSettings(((name, {}), "cpu") if name != "cpu" else ("cpu",))
    if PROVIDERS[name] in ort.get_available_providers():
        assert OnnxModel(content(), settings=settings).providers[0] == name
        return
    with pytest.raises(PerceptionError, match=f"{name!r} is not present.* has .*'cpu'"):
        OnnxModel(content(), settings=settings)


def test_options_of_a_provider_reach_onnxruntime(monkeypatch: pytest.MonkeyPatch) -> None:
    # No accelerator is present wherever this runs, so the session is watched.
    asked = []
    session = ort.InferenceSession

    def watched(*arguments: object, providers: list[tuple[str, dict[str, str]]], **named: object):
        asked.extend(providers)
        return session(*arguments, providers=["CPUExecutionProvider"], **named)

    monkeypatch.setattr(ort, "get_available_providers", lambda: list(PROVIDERS.values()))
    monkeypatch.setattr(ort, "InferenceSession", watched)
    options = {"trt_engine_cache_path": "engines", "trt_fp16_enable": True}
    with pytest.raises(PerceptionError, match=r"'tensorrt' is built into .* could not start"):
        OnnxModel(content(), settings=OnnxSettings((("tensorrt", options), "cuda")))
    assert asked == [
        (
            "TensorrtExecutionProvider",
            {"trt_engine_cache_path": "engines", "trt_fp16_enable": "True"},
        ),
        ("CUDAExecutionProvider", {}),
        ("CPUExecutionProvider", {}),
    ]


def test_options_are_read_from_text() -> None:
    assert parse_provider_options(["a=1", " b = x=y "]) == {"a": "1", "b": "x=y"}
    for texts in (["a"], ["=1"], ["a=1", "a=2"]):
        with pytest.raises(PerceptionError, match="KEY=VALUE, each key once"):
            parse_provider_options(texts)


def test_a_run_with_wrong_inputs_is_refused_with_what_the_network_takes() -> None:
    model = OnnxModel(content())
    for feeds in (
        {"image": np.zeros((1, 3, 32, 64), np.float32)},
        {"images": np.zeros((1, 3, 32, 32), np.float32)},
        {"images": np.zeros((1, 3, 32, 64), np.float64)},
    ):
        with pytest.raises(PerceptionError, match=r"takes images \(any, 3, 32, 64\) float32"):
            model.run(feeds)


def test_the_times_of_runs_are_summed_per_thread() -> None:
    model = OnnxModel(red_point_pose(64, 48))
    feeds = {"input": np.zeros((1, 3, 64, 48), np.float32)}

    def spent() -> list[tuple[float, float]]:
        times = [(NETWORK_TIME.elapsed_s, NETWORK_TIME.processor_s)]
        for _ in range(2):
            model.run(feeds)
            times.append((NETWORK_TIME.elapsed_s, NETWORK_TIME.processor_s))
        return times

    here = np.array(spent())
    assert (np.diff(here, axis=0) > 0.0).all()
    with ThreadPoolExecutor(1) as other:
        there = np.array(other.submit(spent).result())
    assert there[0].tolist() == [0.0, 0.0]
    assert here[-1].tolist() == [NETWORK_TIME.elapsed_s, NETWORK_TIME.processor_s]
    model.run(feeds, timed=False)
    assert here[-1].tolist() == [NETWORK_TIME.elapsed_s, NETWORK_TIME.processor_s]


def test_settings_with_a_loaded_model_are_refused() -> None:
    model = OnnxModel(red_point_pose(32, 32))
    assert OnnxPoseEstimator(model).model is model
    with pytest.raises(PerceptionError, match="loaded already"):
        OnnxPoseEstimator(model, settings=OnnxSettings())


@pytest.mark.parametrize(("given", "found"), [({}, "1"), ({"ORT_DISABLE_TELEMETRY": "0"}, "0")])
def test_onnxruntime_sends_no_telemetry_unless_it_is_allowed(
    given: dict[str, str], found: str, tmp_path: Path
) -> None:
    # ONNX Runtime sends nothing on a build server, so the variables that mark one are removed.
    marks = ("CI", "GITHUB_ACTIONS", "ORT_DISABLE_TELEMETRY")
    kept = {key: value for key, value in os.environ.items() if key not in marks}
    folders = {"TMPDIR": str(tmp_path), "HOME": str(tmp_path)}
    code = "import os, perception.networks; print(os.environ['ORT_DISABLE_TELEMETRY'])"
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={**kept, **folders, "PYTHONPATH": os.pathsep.join(filter(None, sys.path)), **given},
    )
    assert done.stdout == f"{found}\n"
    assert given or list(tmp_path.iterdir()) == []  # no identifier is stored
