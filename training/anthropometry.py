"""Measures the body constants of ``perception.anthropometry`` on a parametric body model.

It averages 27 adult bodies of the default topology (body data of MakeHuman, CC0), with three values
each of gender, height and weight, by the model's own COCO keypoint definitions. It prints limb
lengths as fractions of the stature, and the head template in the paper's head frame. Needs
``pip install anny==0.6.2 torch``.

    python training/anthropometry.py
"""

from __future__ import annotations

import itertools
from pathlib import Path

import anny
import numpy as np
import torch

LIMBS = {
    "torso": (("left_shoulder", "right_shoulder"), ("left_hip", "right_hip")),
    "upper arm": (("left_shoulder",), ("left_elbow",)),
    "forearm": (("left_elbow",), ("left_wrist",)),
    "thigh": (("left_hip",), ("left_knee",)),
    "shank": (("left_knee",), ("left_ankle",)),
    "shoulder span": (("left_shoulder",), ("right_shoulder",)),
    "hip span": (("left_hip",), ("right_hip",)),
}
HEAD = ("nose", "left_eye", "right_eye", "left_ear", "right_ear")
GENDERS, HEIGHTS, WEIGHTS = (0.0, 0.5, 1.0), (0.3, 0.5, 0.7), (0.35, 0.5, 0.65)
ADULT_AGE = 0.66


def main() -> None:
    """Print the averages."""
    model = anny.Anny().to(dtype=torch.float32)
    regressors = torch.load(
        Path(anny.__file__).parent / "data" / "keypoints" / "coco.pth", weights_only=True
    )
    used = model.base_mesh_vertex_indices.numpy()
    weights = {name: row.numpy()[used] for name, row in regressors.items()}
    rest = torch.eye(4)[None, None].repeat(1, model.bone_count, 1, 1)
    fractions: dict[str, list[float]] = {name: [] for name in LIMBS}
    heads, necks = [], []
    for gender, height, weight in itertools.product(GENDERS, HEIGHTS, WEIGHTS):
        phenotype = dict.fromkeys(model.phenotype_labels, 0.5)
        phenotype |= {"age": ADULT_AGE, "gender": gender, "height": height, "weight": weight}
        posed = model(pose_parameters=rest, phenotype_kwargs=phenotype)
        vertices = posed["vertices"][0].numpy()
        points = {name: row @ vertices / row.sum() for name, row in weights.items()}
        stature = float(np.ptp(vertices[:, 2]))
        for name, ends in LIMBS.items():
            first, second = (np.mean([points[end] for end in side], axis=0) for side in ends)
            fractions[name].append(float(np.linalg.norm(first - second)) / stature)
        # The model faces −y with its left side towards +x and z up; the head frame is x down,
        # y forward, z right.
        to_head = np.array([[0.0, 0.0, -1.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0]])
        heads.append([to_head @ (points[name] - points["nose"]) for name in HEAD])
        neck = 0.5 * (points["left_shoulder"] + points["right_shoulder"])
        necks.append(to_head @ (points["nose"] - neck))
    print("limb lengths / stature (mean, standard deviation)")
    for name, values in fractions.items():
        print(f"  {name:14s} {np.mean(values):.3f}  {np.std(values):.3f}")
    print("head template (m): x down, y forward, z right; origin nose")
    for name, row in zip(HEAD, np.mean(heads, axis=0), strict=True):
        print(f"  {name:10s} " + " ".join(f"{value:7.4f}" for value in row))
    down, forward, _ = np.mean(necks, axis=0)
    print(f"neck to nose: {forward:.3f} m forward, {-down:.3f} m up")


if __name__ == "__main__":
    main()
