"""The naked body at rest: surface, joints, weights and keypoints from the model ``anny``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import anny
import numpy as np
import torch
from scipy.sparse import csr_matrix, diags
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

from ._piece import Array, Triangles, smoothstep

# The model looks along −y with its left at +x; here x is forward and y left.
_TO_BODY: Final = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
_DOWN: Final = np.array([0.0, 0.0, -1.0])
_JOINTS: Final = 16
_SPINE_BLEND_M: Final = 0.095
#: Length of the bend on either side of a joint: elbow and knee, wrist.
_LIMB_BLEND_M: Final = {5: 0.065, 8: 0.065, 11: 0.075, 14: 0.075, 6: 0.035, 9: 0.035}
_FINGER_CURL_RAD: Final = np.radians((20.0, 26.0, 18.0))
KEYPOINTS: Final = (
    "nose", "left_eye", "right_eye", "left_ear", "right_ear", "left_shoulder", "right_shoulder",
    "left_elbow", "right_elbow", "left_wrist", "right_wrist", "left_hip", "right_hip", "left_knee",
    "right_knee", "left_ankle", "right_ankle", "left_big_toe", "left_small_toe", "left_heel",
    "right_big_toe", "right_small_toe", "right_heel",
)  # fmt: skip
# First bone beyond each limb joint, in the order of the joints from left_shoulder on.
_LIMB_BONES: Final = ("upperarm01", "lowerarm01", "wrist", "upperleg01", "lowerleg01", "foot")


@dataclass(frozen=True, eq=False)
class Body:
    """A naked body at rest in the body frame.

    Attributes:
        vertices_m: (N, 3), the model's own vertices; row k is the same place on every body.
        triangles: (T, 3) of the skin, without the mouth's inside and without eyeballs.
        eyes: (T, 3) triangles of the left and of the right eyeball.
        weights: (N, 16) of the joints.
        joints_m: (16, 3).
        keypoints_m: (23, 3).
        keypoint_weights: (23, 16).
        bones_m: heads of the model's bones.
        scalp_z_m: height of the top of the head.
    """

    vertices_m: Array
    triangles: Triangles
    eyes: tuple[Triangles, Triangles]
    weights: Array
    joints_m: Array
    keypoints_m: Array
    keypoint_weights: Array
    bones_m: dict[str, Array]

    @property
    def scalp_z_m(self) -> float:
        """Height of the top of the bare head."""
        return float(self.vertices_m[:, 2].max())


class BodyModel:
    """The model ``anny`` in its default topology, posed to rest."""

    def __init__(self) -> None:
        torch.set_num_threads(1)
        self._model: Any = anny.Anny(local_changes="default").to(dtype=torch.float32)
        self._bones: list[str] = list(self._model.bone_labels)
        self._parents: list[int] = [int(parent) for parent in self._model.bone_parents]
        self._faces = np.asarray(self._model.faces, dtype=np.int64)
        index = self._model.vertex_bone_indices.numpy()
        weight = self._model.vertex_bone_weights.numpy().astype(np.float64)
        self._skinning = np.zeros((len(index), len(self._bones)))
        np.add.at(self._skinning, (np.arange(len(index))[:, None], index), weight)
        self._skinning /= self._skinning.sum(axis=1, keepdims=True)
        self._skin, self._eyes = self._split()
        self._regressor = self._keypoint_regressor()

    def rest(
        self,
        phenotype: Mapping[str, float],
        changes: Mapping[str, float] | None = None,
        *,
        abduction_rad: float,
    ) -> Body:
        """Return a body at rest: legs vertical, arms down, palms inwards, soles at z = 0."""
        values = dict.fromkeys(self._model.phenotype_labels, 0.5) | dict(phenotype)
        local = dict.fromkeys(self._model.local_change_labels, 0.0) | dict(changes or {})
        _, heads = self._run(values, local, {})
        pose = self._rest_pose(heads, abduction_rad)
        vertices, heads = self._run(values, local, pose)
        hips = 0.5 * (heads["upperleg01.L"] + heads["upperleg01.R"])
        shift = np.array([hips[0], hips[1], vertices[:, 2].min()])
        vertices = vertices - shift
        bones = {name: head - shift for name, head in heads.items()}
        joints = self._joints(vertices, bones)
        weights = self._weights(vertices, bones, joints)
        return Body(
            vertices_m=vertices,
            triangles=self._skin,
            eyes=self._eyes,
            weights=weights,
            joints_m=joints,
            keypoints_m=self._regressor @ vertices,
            keypoint_weights=self._snap(self._regressor @ weights),
            bones_m=bones,
        )

    def height_for(
        self, scalp_z_m: float, phenotype: Mapping[str, float], changes: Mapping[str, float]
    ) -> dict[str, float]:
        """Return the phenotype with a bare body ``scalp_z_m`` tall, by bisection over height."""
        low, high = 0.0, 1.0
        for _ in range(14):
            height = 0.5 * (low + high)
            body = self.rest({**phenotype, "height": height}, changes, abduction_rad=0.17)
            low, high = (height, high) if body.scalp_z_m < scalp_z_m else (low, height)
        return {**phenotype, "height": height}

    @lru_cache(maxsize=1)  # noqa: B019 - one model lives as long as the program
    def average(self) -> Body:
        """The body on which paint is laid out."""
        return self.rest({"age": 0.66}, abduction_rad=np.radians(10.0))

    def _run(
        self, phenotype: dict[str, float], changes: dict[str, float], pose: dict[str, Array]
    ) -> tuple[Array, dict[str, Array]]:
        """Return vertices and bone heads for ``pose``, rotations of the bones in the body frame."""
        total: list[Array] = []
        parameters = torch.eye(4)[None, None].repeat(1, len(self._bones), 1, 1)
        for row, (name, parent) in enumerate(zip(self._bones, self._parents, strict=True)):
            above = total[parent] if parent >= 0 else np.eye(3)
            total.append(pose.get(name, above))
            own = _TO_BODY.T @ (above.T @ total[row]) @ _TO_BODY
            parameters[0, row, :3, :3] = torch.tensor(own, dtype=torch.float32)
        posed = self._model(
            pose_parameters=parameters, phenotype_kwargs=phenotype, local_changes_kwargs=changes
        )
        vertices = posed["vertices"][0].double().numpy() @ _TO_BODY.T
        heads = posed["bone_poses"][0, :, :3, 3].double().numpy() @ _TO_BODY.T
        return vertices, dict(zip(self._bones, heads, strict=True))

    def _rest_pose(self, heads: dict[str, Array], abduction_rad: float) -> dict[str, Array]:
        """Return the rotation of each bone from the model's A-pose to rest."""
        pose: dict[str, Array] = {}
        for side, left in (("L", 1.0), ("R", -1.0)):
            bone = {name.removesuffix(f".{side}"): p for name, p in heads.items()}
            thigh = bone["lowerleg01"] - bone["upperleg01"]
            shank = bone["foot"] - bone["lowerleg01"]
            foot = bone["toe3-1"] - bone["foot"]
            pose[f"upperleg01.{side}"] = _turn(thigh, _DOWN)
            pose[f"lowerleg01.{side}"] = _turn(shank, _DOWN)
            out = np.arctan2(left * foot[1], foot[0])
            pose[f"foot.{side}"] = _about((0, 0, 1), left * (np.radians(7.0) - out))
            lean, bend = np.radians(2.0), np.radians(12.0)
            down = np.array([np.sin(lean), left * np.sin(abduction_rad), -np.cos(abduction_rad)])
            fore = _about((0, 1, 0), -bend) @ down
            arm = _turn(bone["lowerarm01"] - bone["upperarm01"], down)
            sunk = Rotation.from_matrix(arm).as_rotvec()
            pose[f"clavicle.{side}"] = Rotation.from_rotvec(0.08 * sunk).as_matrix()
            pose[f"shoulder01.{side}"] = Rotation.from_rotvec(0.22 * sunk).as_matrix()
            pose[f"upperarm01.{side}"] = arm
            elbow = _turn(bone["wrist"] - bone["lowerarm01"], fore)
            pose[f"lowerarm01.{side}"] = elbow
            # The hand: fingers along the forearm, palm towards the thigh and slightly back.
            along = bone["finger3-1"] - bone["wrist"]
            across = bone["finger2-1"] - bone["finger5-1"]
            palm = left * np.cross(along, across)
            inward = np.array([-0.2, -left, 0.0])
            hand = _frame(fore, inward) @ _frame(along, palm).T
            half = Rotation.from_matrix(elbow.T @ hand).as_rotvec()
            pose[f"lowerarm02.{side}"] = elbow @ Rotation.from_rotvec(0.5 * half).as_matrix()
            pose[f"wrist.{side}"] = hand
            _, inside, hinge = _frame(fore, inward).T
            thumb = hand @ (bone["finger1-2"] - bone["finger1-1"])
            rested = _turn(thumb, fore + 0.45 * inside + np.array([0.35, 0.0, 0.0])) @ hand
            for finger in range(1, 6):
                turn = rested if finger == 1 else hand
                for link, angle in enumerate(_FINGER_CURL_RAD, start=1):
                    share = 0.3 if finger == 1 else 0.85 + 0.06 * finger
                    turn = _about(hinge, share * angle) @ turn
                    pose[f"finger{finger}-{link}.{side}"] = turn
        return pose

    def _joints(self, vertices: Array, bones: dict[str, Array]) -> Array:
        eyes = [vertices[np.unique(eye)].mean(axis=0) for eye in self._eyes]
        neck = 0.5 * (bones["neck02"] + bones["neck03"])
        arms = [[bones[f"{b}.{s}"] for b in _LIMB_BONES[:3]] for s in "LR"]
        legs = [[bones[f"{b}.{s}"] for b in _LIMB_BONES[3:]] for s in "LR"]
        joints = np.array([bones["spine04"], neck, *eyes, *arms[0], *arms[1], *legs[0], *legs[1]])
        joints[:2, 1] = 0.0
        return joints

    def _weights(self, vertices: Array, bones: dict[str, Array], joints: Array) -> Array:
        """Return (N, 16), the share of the model's skinning weights beyond each joint."""
        weights = np.zeros((len(vertices), _JOINTS))
        for column, (bone, side) in enumerate(
            [(b, s) for part in (_LIMB_BONES[:3], _LIMB_BONES[3:]) for s in "LR" for b in part],
            start=4,
        ):
            weights[:, column] = self._skinning[:, self._beyond(f"{bone}.{side}")].sum(axis=1)
        share = {"neck01": 0.15, "neck02": 0.5, "neck03": 0.9}
        weights[:, 1] = self._skinning[:, self._beyond("head")].sum(axis=1) + sum(
            part * self._skinning[:, self._bones.index(name)] for name, part in share.items()
        )
        weights = self._snap(self._smooth(weights, 6))
        self._bend(weights, vertices, joints)
        spine = joints[0, 2]
        rise = smoothstep(vertices[:, 2], spine - _SPINE_BLEND_M, spine + _SPINE_BLEND_M)
        arms = weights[:, 4] + weights[:, 7]
        weights[:, 0] = np.maximum(rise, smoothstep(arms, 0.0, 0.6))
        for eye, column in zip(self._eyes, (2, 3), strict=True):
            rows = np.unique(eye)
            weights[rows] = 0.0
            weights[np.ix_(rows, (0, 1, column))] = 1.0
        return weights

    @staticmethod
    def _bend(weights: Array, vertices: Array, joints: Array) -> None:
        """Give elbows, wrists and knees bends of fixed length; make the skull rigid."""
        for joint, reach in _LIMB_BLEND_M.items():
            wrist = joint in (6, 9)
            before = joints[joint - 1]
            after = 2.0 * joints[joint] - before if wrist else joints[joint + 1]
            axis = _unit(after - before)
            along = (vertices - joints[joint]) @ axis
            weights[:, joint] = weights[:, joint - 1] * smoothstep(along, -reach, reach)
        for ankle in (12, 15):
            weights[:, ankle] = np.minimum(weights[:, ankle], weights[:, ankle - 1])
        neck = joints[1]
        skull = vertices[:, 2] - neck[2] - 0.034 + 0.30 * (vertices[:, 0] - neck[0])
        weights[:, 1] = np.maximum(weights[:, 1], smoothstep(skull, -0.06, 0.0))

    @staticmethod
    def _snap(weights: Array) -> Array:
        """Return weights that are exactly 0 or 1 away from the joints."""
        snapped: Array = np.clip((weights - 0.02) / 0.96, 0.0, 1.0)
        return snapped

    def _beyond(self, bone: str) -> list[int]:
        """Return the rows of ``bone`` and of all its descendants."""
        rows = [self._bones.index(bone)]
        for row, parent in enumerate(self._parents):
            if parent in rows:
                rows.append(row)
        return rows

    def _smooth(self, values: Array, rounds: int) -> Array:
        """Return values averaged with the neighbours' ``rounds`` times, columns still in order."""
        step = self.neighbours()
        for _ in range(rounds):
            values = 0.5 * values + 0.5 * (step @ values)
        return values

    def neighbours(self) -> csr_matrix:
        """Return the matrix (N, N) of the mean over each vertex's neighbours."""
        ends = np.concatenate(
            [self._faces[:, [0, 1]], self._faces[:, [1, 2]], self._faces[:, [2, 0]]]
        )
        ends = np.concatenate([ends, ends[:, ::-1]])
        count = self._skinning.shape[0]
        joined = csr_matrix((np.ones(len(ends)), ends.T), shape=(count, count))
        joined.data[:] = 1.0
        return diags(1.0 / np.maximum(joined.sum(axis=1).A1, 1.0)) @ joined

    def _split(self) -> tuple[Triangles, tuple[Triangles, Triangles]]:
        """Return the triangles of the skin and of the two eyeballs, without the tongue."""
        count = self._skinning.shape[0]
        edges = (np.ones(len(self._faces) * 2), np.r_[self._faces[:, :2], self._faces[:, 1:]].T)
        _, part = connected_components(csr_matrix(edges, shape=(count, count)), directed=False)
        face_part = part[self._faces[:, 0]]
        skin = self._faces[face_part == np.bincount(part).argmax()]
        eyes = []
        for side in "LR":
            column = self._skinning[:, self._bones.index(f"eye.{side}")]
            eyes.append(self._faces[face_part == part[column.argmax()]])
        return skin, (eyes[0], eyes[1])

    def _keypoint_regressor(self) -> Array:
        """Return the model's own COCO definitions (23, N): weights of vertices."""
        file = Path(anny.__file__).parent / "data" / "keypoints" / "coco.pth"
        rows = torch.load(file, weights_only=True)
        used = self._model.base_mesh_vertex_indices.numpy()
        matrix = np.array([rows[name].double().numpy()[used] for name in KEYPOINTS])
        normal: Array = matrix / matrix.sum(axis=1, keepdims=True)
        return normal


def _unit(vector: Array) -> Array:
    unit: Array = vector / np.linalg.norm(vector)
    return unit


def _about(axis: Any, angle_rad: float) -> Array:
    """Return the rotation matrix about an axis."""
    turn: Array = Rotation.from_rotvec(_unit(np.asarray(axis, dtype=float)) * angle_rad).as_matrix()
    return turn


def _turn(start: Array, end: Array) -> Array:
    """Return the smallest rotation from one direction to the other."""
    axis = np.cross(_unit(start), _unit(end))
    sine = float(np.linalg.norm(axis))
    if sine < 1e-9:
        return np.eye(3)
    return _about(axis, float(np.arctan2(sine, _unit(start) @ _unit(end))))


def _frame(along: Array, towards: Array) -> Array:
    """Return columns ``along``, ``towards`` made perpendicular to it, and their cross product."""
    first = _unit(along)
    second = _unit(towards - (towards @ first) * first)
    return np.stack([first, second, np.cross(first, second)], axis=1)
