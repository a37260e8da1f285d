"""Command ``python -m training.networks``: make the networks that ship with ``perception``.

The stages are a crowd and its images, three networks, and the export. Every stage continues where
it was interrupted.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Final, TypeVar

import cv2
import onnx
import torch
from torch import nn

from perception import OnnxPoseEstimator
from sim_tests.actors.body import load_worker

from ..manifest import update_manifest
from . import _detector_train, _head_train, _pose_train
from ._calibrate import limb_scale
from ._detector_data import DetectorData
from ._detector_net import DetectorNet
from ._detector_train import train_detector
from ._export import export_detector, export_head, export_pose
from ._fit import AUTO, torch_device
from ._head_data import HeadData
from ._head_net import HeadNet
from ._head_shapes import add_head_shapes, bodies
from ._head_train import calibration, predictions, train_head
from ._pose_data import PoseData
from ._pose_net import PoseNet
from ._pose_train import train_pose
from ._recipe import Recipe, Run
from ._shards import make_shards
from .quantise import quantise

_ROOT: Final = Path(__file__).parents[2]
_MODELS: Final = _ROOT / "perception" / "models"
# The last commit with training/workers, which makes random workers.
_CROWD_COMMIT: Final = "11d37c7"
_STAGES: Final = ("data", "head", "pose", "detector", "export")
_TRAINERS: Final[dict[str, Callable[[Run], nn.Module]]] = {
    "head": train_head,
    "pose": train_pose,
    "detector": train_detector,
}
_FILES: Final = {"head": "head_pose", "pose": "person_pose", "detector": "person_detector"}
# Images from which the ranges of 8-bit activations come.
_RANGE_IMAGES: Final = 200
_Net = TypeVar("_Net", bound=nn.Module)
_ENTRIES: Final = (
    {
        "name": "person_detector",
        "licence": "Apache-2.0",
        "input": "(1, 3, 256, 320) RGB / 255, centred letterbox 114",
        "summary": "Finds people; YOLOv8's layout. Made for the simulator.",
        "training_domain": "renders",
    },
    {
        "name": "person_pose",
        "licence": "Apache-2.0",
        "input": "(N, 3, 192, 144) RGB, ImageNet mean and standard deviation, box padding 1.25",
        "summary": "COCO's 17 keypoints in the image and in depth; RTMW3D's layout. Made for the "
        "simulator.",
        "training_domain": "renders",
    },
    {
        "name": "head_pose",
        "licence": "Apache-2.0",
        "input": "(N, 3, 64, 64) RGB, mean 120, standard deviation 60, square head crop",
        "summary": "Rotation, keypoints, visibility and place of a head, each with its "
        "uncertainty. Made for the simulator.",
        "training_domain": "renders",
    },
)


def main() -> None:
    """Run the stages asked for, by default all."""
    parser = argparse.ArgumentParser(prog="python -m training.networks", description=__doc__)
    parser.add_argument(
        "stages",
        nargs="*",
        metavar="STAGE",
        help=f"some of {', '.join(_STAGES)} (default: all); export writes the networks of the "
        "stages named beside it, or all",
    )
    parser.add_argument(
        "--work",
        type=Path,
        default=_ROOT / "build" / "networks",
        help="folder of intermediate results",
    )
    parser.add_argument("--out", type=Path, default=_MODELS, help="folder of the networks")
    parser.add_argument("--seed", type=int, default=0, help="default: %(default)s")
    parser.add_argument("--processes", type=int, default=2, help="processes that render")
    parser.add_argument(
        "--device", default=AUTO, help="auto, cpu, cuda or cuda:N (default: %(default)s)"
    )
    parser.add_argument(
        "--long",
        action="store_true",
        help="train the head network as long as the shipped one, for a GPU with many cores",
    )
    parser.add_argument("--quick", action="store_true", help="a tiny run that checks every stage")
    chosen = parser.parse_args()
    unknown = [stage for stage in chosen.stages if stage not in _STAGES]
    if unknown:
        parser.error(f"there is no stage {', '.join(unknown)}; stages are {', '.join(_STAGES)}")
    stages = chosen.stages or list(_STAGES)
    recipe = replace(Recipe(), seed=chosen.seed)
    recipe = recipe.long() if chosen.long else recipe
    recipe = recipe.quick() if chosen.quick else recipe
    if chosen.quick and chosen.out == _MODELS:
        parser.error("--quick needs --out: its networks are useless and must not ship")
    try:
        torch_device(chosen.device)
    except ValueError as cause:
        parser.error(str(cause))
    cv2.setNumThreads(1)
    work: Path = chosen.work
    shards, check = work / "shards", work / "shards_check"
    if "data" in stages:
        held_out = recipe.held_out()
        # Both crowds are asked for before hours of rendering.
        crowd, others = _crowd(recipe, work / "crowd"), _crowd(held_out, work / "crowd_check")
        make_shards(recipe, crowd, shards, chosen.processes)
        make_shards(held_out, others, check, chosen.processes)
    for name, train in _TRAINERS.items():
        if name in stages:
            train(Run(recipe, shards, check, work / "checkpoints", chosen.device))
    if "export" in stages:
        names = set(_TRAINERS) & set(stages) or set(_TRAINERS)
        _export(recipe, check, work / "checkpoints", chosen.out, names)


def _crowd(recipe: Recipe, folder: Path) -> tuple[str, ...]:
    """Return the files of the random workers, with heads of other shapes that are made here.

    Raises:
        SystemExit: for a folder with fewer workers than the recipe has.
    """
    found = len(bodies(folder))
    if found < recipe.crowd:
        raise SystemExit(
            f"{folder} has {found} of {recipe.crowd} random workers. Commit {_CROWD_COMMIT} makes "
            "them, with the packages of its training/workers/requirements.txt:\n"
            f"  git worktree add build/workers {_CROWD_COMMIT} && cd build/workers\n"
            f"  python -m training.workers --random {recipe.crowd} --seed {recipe.seed} "
            f"--out {folder.resolve()}"
        )
    add_head_shapes(folder, recipe.head_shapes, recipe.seed)
    return tuple(str(path) for path in sorted(folder.glob("*.npz")))


def _export(recipe: Recipe, check: Path, checkpoints: Path, out: Path, names: set[str]) -> None:
    """Write networks of the checkpoints in 8 bits, calibrated on held-out people.

    In full precision they are written beside the checkpoints.
    """
    seed, backgrounds = recipe.seed, recipe.check_backgrounds
    if "head" in names:
        head, whole = _trained(HeadNet(), checkpoints / "head.pt"), checkpoints / "head_pose.onnx"
        heads = HeadData(check, seed, backgrounds)
        # Half of the crops are degraded: a robot's camera is between the two.
        factors = calibration(predictions(head, heads, degraded=True))
        print("factors on the standard deviations:", factors)
        export_head(head, whole, factors)
        crops = heads.still(0, _RANGE_IMAGES, degraded=True)["image"]
        _quantise(whole, _head_train.normalised(crops), out)
    if "pose" in names:
        pose, whole = _trained(PoseNet(), checkpoints / "pose.pt"), checkpoints / "person_pose.onnx"

        def with_scale(scale: float) -> OnnxPoseEstimator:
            export_pose(pose, whole, scale)
            return OnnxPoseEstimator(whole)

        crowd = sorted(check.with_name("crowd_check").glob("*.npz"))
        statures_m = [load_worker(str(path)).stature_m for path in crowd]
        scale, noise = limb_scale(with_scale, check, statures_m)
        print(f"limb scale against perception.anthropometry: {scale:.3f}, noise {noise:.3f}")
        export_pose(pose, whole, scale, noise)
        crops = PoseData(check, seed, backgrounds).still(0, _RANGE_IMAGES)["image"]
        _quantise(whole, _pose_train.normalised(crops), out)
    if "detector" in names:
        detector = _trained(DetectorNet(), checkpoints / "detector.pt")
        whole = checkpoints / "person_detector.onnx"
        export_detector(detector, whole)
        images = DetectorData(check, seed, backgrounds).batch(0, _RANGE_IMAGES)["image"]
        _quantise(whole, _detector_train.normalised(images), out)
    written = {_FILES[name] for name in names}
    print("written", update_manifest(out, [each for each in _ENTRIES if each["name"] in written]))


def _quantise(whole: Path, images: torch.Tensor, out: Path) -> None:
    """Write a network in 8 bits, with the ranges of its activations from images (N, 3, H, W)."""
    (name,) = (each.name for each in onnx.load(str(whole)).graph.input)
    quantise(whole, [{name: image[None].numpy()} for image in images], out / whole.name)


def _trained(net: _Net, checkpoint: Path) -> _Net:
    """Return the network with the averaged weights of a checkpoint."""
    saved = torch.load(checkpoint, map_location="cpu", weights_only=True)
    net.load_state_dict(saved["average"])
    return net.eval()


if __name__ == "__main__":
    main()
