"""Export of trained networks as the shipped ONNX files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
import onnx
import onnxruntime
import torch
from torch import nn

from ._detector_net import HEIGHT, STRIDES, WIDTH, DetectorExport, DetectorNet
from ._head_net import HeadExport, HeadNet
from ._pose_net import PoseExport, PoseNet

_OPSET: Final = 17
_LICENCE: Final = "Apache-2.0"
# Largest change by half-precision weights, as a share of the output's range.
_TOLERANCE: Final = 1e-2
# Least elements of a tensor that is stored in half precision.
_LARGE: Final = 1024


def export_detector(net: DetectorNet, path: Path) -> None:
    """Write the detector with the metadata that identify a YOLOv8 export.

    Height and width are open, as in exports with ``dynamic=True``; ``imgsz`` is the usual size.
    """
    metadata = {
        "description": "person detector of awarenav, made for its simulator",
        "license": _LICENCE,
        "task": "detect",
        "stride": str(max(STRIDES)),
        "imgsz": f"[{HEIGHT}, {WIDTH}]",
        "batch": "1",
        "names": "{0: 'person'}",
    }
    example = torch.rand(1, 3, HEIGHT, WIDTH)
    axes = {"images": {2: "height", 3: "width"}, "output0": {2: "cells"}}
    _export(DetectorExport(net), example, "images", path, metadata, axes)


def export_pose(net: PoseNet, path: Path, limb_scale: float, scale_std: float = 0.0) -> None:
    """Write the pose network in RTMW3D's layout with COCO's 17 keypoints.

    Args:
        net: trained network.
        path: file to write.
        limb_scale: see :func:`._calibrate.limb_scale`.
        scale_std: relative standard deviation of the body's scale by the network's noise; 0 is left
            out.
    """
    metadata = {
        "description": "whole-body pose of awarenav, made for its simulator",
        "license": _LICENCE,
        "keypoints": "coco",
        "simcc_split_ratio": "2",
        "box_padding": "1.25",
        "z_range_m": "2.1744869",
        "limb_scale": f"{limb_scale:.3f}",
    }
    if scale_std > 0.0:
        metadata["scale_relative_std"] = f"{scale_std:.3f}"
    _export(PoseExport(net), torch.randn(2, 3, 192, 144), "input", path, metadata)


def export_head(net: HeadNet, path: Path, factors: Mapping[str, float]) -> None:
    """Write the head network with its calibration."""
    metadata = {
        "description": "head pose of awarenav, made for its simulator",
        "license": _LICENCE,
        "awarenav_model": "head_pose",
        "awarenav_layout": "1",
        "crop_side_m": "0.40",
        "mean": "120",
        "std": "60",
        "head_centre_head_m": "-0.045,-0.090,0",
    }
    whole = HeadExport(net, factors["rotation"], factors["side"], factors["keypoint"])
    _export(whole, torch.randn(2, 3, 64, 64), "image", path, metadata)


def _halve(model: onnx.ModelProto) -> None:
    """Store large weights in half precision; the runtime widens them when it loads the model."""
    graph = model.graph
    casts = []
    for tensor in graph.initializer:
        if tensor.data_type != onnx.TensorProto.FLOAT or np.prod(tensor.dims) < _LARGE:
            continue
        name = tensor.name
        half = onnx.numpy_helper.to_array(tensor).astype(np.float16)
        tensor.CopyFrom(onnx.numpy_helper.from_array(half, name + "_half"))
        casts.append(onnx.helper.make_node("Cast", [name + "_half"], [name], to=1))
    nodes = list(graph.node)
    del graph.node[:]
    graph.node.extend([*casts, *nodes])


def _export(
    module: Any,
    example: torch.Tensor,
    name: str,
    path: Path,
    metadata: Mapping[str, str],
    open_axes: Mapping[str, Mapping[int, str]] | None = None,
) -> None:
    """Export, add metadata, and compare with PyTorch; the file is written whole or not at all.

    The number of images is open unless ``open_axes`` says otherwise.
    """
    assert isinstance(module, nn.Module)
    module = module.cpu().float().eval()
    outputs = list(module.names)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    with torch.no_grad():
        torch.onnx.export(
            module,
            (example,),
            str(part),
            input_names=[name],
            output_names=outputs,
            opset_version=_OPSET,
            dynamic_axes=open_axes or {key: {0: "batch"} for key in (name, *outputs)},
            dynamo=False,
        )
        wanted = module(example)
    model = onnx.load(str(part))
    # The order of entries and the producer's version must not change the file from run to run.
    model.producer_name, model.producer_version = "awarenav", ""
    told = {**metadata, "training_domain": "renders"}
    for key in sorted(told):
        entry = model.metadata_props.add()
        entry.key, entry.value = key, told[key]
    _halve(model)
    onnx.checker.check_model(model)
    part.write_bytes(model.SerializeToString(deterministic=True))
    session = onnxruntime.InferenceSession(part.read_bytes(), providers=["CPUExecutionProvider"])
    got = session.run(outputs, {name: example.numpy()})
    for key, ours, theirs in zip(
        outputs, got, wanted if isinstance(wanted, tuple) else (wanted,), strict=True
    ):
        error = float(np.abs(np.asarray(ours) - theirs.numpy()).max())
        scale = max(1.0, float(theirs.abs().max()))
        if error > _TOLERANCE * scale:
            raise RuntimeError(f"{path.name}: {key} differs by {error:g} from PyTorch")
    part.replace(path)
