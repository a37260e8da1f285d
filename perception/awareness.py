"""The attention cone, and awareness α of people with its standard deviation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from ._stages import HeadPose
from .anthropometry import EYES_HEAD_M
from .arrays import FloatArray, finite_array, finite_number, set_fields
from .errors import PerceptionError
from .eyes import EyeGaze

_Vector = Sequence[float]

#: Half of θ_FOV = 120°, the horizontal field of view that head orientation alone supports.
DEFAULT_HALF_ANGLE_RAD: Final = math.radians(60.0)
#: How far the head may be lowered below the robot: α falls from the first angle on and is 0 at the
#: second. Eyes like to look down in the head, by 29° with a deviation of 12° (Kroemer and Hill
#: 1986, doi:10.1080/00140138608967228), so they are hardly raised by more than the first. Heads are
#: lowered by 31° to read a phone while walking and by 39° to write, and by −1° without one (Han and
#: Shin 2019, doi:10.1016/j.apergo.2019.102884); the line to a robot 3 m away falls by about
#: 15°.
DEFAULT_RAISED_RAD: Final = (math.radians(8.0), math.radians(22.0))


@dataclass(frozen=True, slots=True)
class AttentionCone:
    """Awareness score of a target in a cone around the gaze (eqs. (1)–(3) of the paper).

    α = 1 − d⊥ / (d · tan half-angle) for a target ahead of the apex and inside the cone, else 0;
    d is the distance along the gaze and d⊥ the distance from its axis. The paper gives the cone's
    radius as d · tan θ_FOV but calls θ_FOV/2 its half-angle; here one half-angle replaces both.

    With ``up`` the score is lower for a head that is lowered. It is multiplied by 1 if the head
    would have to rise (about the ears) by up to ``raised_rad[0]`` until the target is neither above
    nor below it, by 0 from ``raised_rad[1]`` on, and by a straight line between. Whoever reads or
    works with a lowered head looks at something nearer than the target.

    Attributes:
        half_angle_rad: half-angle of the cone, in (0, π/2).
        raised_rad: the two angles, 0 ≤ first < second ≤ π/2; None for the printed cone.
    """

    half_angle_rad: float = DEFAULT_HALF_ANGLE_RAD
    raised_rad: tuple[float, float] | None = DEFAULT_RAISED_RAD

    @classmethod
    def printed(cls, half_angle_rad: float = DEFAULT_HALF_ANGLE_RAD) -> AttentionCone:
        """Return the cone as the paper prints it, in which up and down count as left and right."""
        return cls(half_angle_rad, None)

    def __post_init__(self) -> None:
        angle = finite_number(
            "half_angle_rad", self.half_angle_rad, minimum=0.0, exclusive_minimum=True
        )
        if angle >= 0.5 * math.pi:
            raise PerceptionError(f"half_angle_rad must lie in (0, pi/2), got {angle:g} rad")
        raised = self.raised_rad
        if raised is not None:
            first, second = finite_array("raised_rad", raised, (2,)).tolist()
            if not 0.0 <= first < second <= 0.5 * math.pi:
                raise PerceptionError(
                    f"raised_rad must be two rising angles in [0, pi/2], got {raised!r}"
                )
            raised = first, second
        set_fields(self, half_angle_rad=angle, raised_rad=raised)

    def score(
        self, apex_m: ArrayLike, gaze: ArrayLike, target_m: ArrayLike, up: ArrayLike | None = None
    ) -> Any:
        """Return α in [0, 1].

        Args:
            apex_m: (3,) or (N, 3) apex of the cone.
            gaze: (3,) or (N, 3) vectors along the gaze, of any length > 0.
            target_m: for one gaze (3,), or (M, 3) points of one target, of which the highest score
                counts: a person who sees any part of the robot sees the robot. For N gazes (3,), or
                (N, 3) with one target per gaze. All vectors are in the same frame.
            up: (3,), or (N, 3) for N gazes: vectors from the head to its crown, of any length;
                None for eq. (3) alone.

        Returns:
            A float for one gaze, (N,) for N gazes.

        Raises:
            PerceptionError: for another shape, a non-finite number, a gaze of length 0 or one
                along ``up``.
        """
        given = {"apex_m": apex_m, "gaze": gaze, "target_m": target_m}
        if up is not None:
            given["up"] = up
        arrays = {name: np.asarray(value, dtype=np.float64) for name, value in given.items()}
        for name, array in arrays.items():
            if array.ndim not in (1, 2) or array.shape[-1] != 3:
                raise PerceptionError(f"{name} must have shape (3,) or (N, 3), got {array.shape}")
            if not np.isfinite(array).all():
                raise PerceptionError(f"{name} must be finite, got {array.tolist()!r:.120}")
        one_gaze = arrays["apex_m"].ndim == 1 and arrays["gaze"].ndim == 1
        try:
            scores = self.scores(*arrays.values())
        except ValueError as cause:
            if isinstance(cause, PerceptionError):
                raise
            raise PerceptionError(
                f"{', '.join(arrays)} must have equal lengths N where they are (N, 3), got "
                f"{', '.join(str(array.shape) for array in arrays.values())}"
            ) from cause
        return float(np.max(scores, initial=0.0)) if one_gaze else scores

    def scores(
        self,
        apex_m: FloatArray,
        gaze: FloatArray,
        target_m: FloatArray,
        up: FloatArray | None = None,
    ) -> FloatArray:
        """Return α (…,) of (…, 3) arrays under NumPy broadcasting, without checks of the input."""
        unit = _unit("gaze", gaze)
        offset = target_m - apex_m
        axial = _dot(offset, unit)
        across = offset - axial[..., None] * unit
        perpendicular = np.sqrt(_dot(across, across))
        radius = axial * math.tan(self.half_angle_rad)
        inside = (axial > 0.0) & (perpendicular <= radius)
        ratio = np.divide(perpendicular, radius, out=np.ones_like(radius), where=inside)
        scores = np.where(inside, 1.0 - ratio, 0.0)
        if up is not None and self.raised_rad is not None:
            above = _dot(offset, _unit("up", up - _dot(up, unit)[..., None] * unit))
            scores = scores * self.shares(axial, above)
        return np.asarray(scores, dtype=np.float64)

    def score_of(
        self, apex_m: _Vector, gaze: _Vector, target_m: _Vector, up: _Vector | None = None
    ) -> float:
        """Return :meth:`scores` of one gaze in plain floats, which take a tenth of the time."""
        # The sums are in the order of einsum, so that both give the same digits.
        gx, gy, gz = gaze
        length = math.sqrt(gx * gx + gz * gz + gy * gy)
        if not length > 0.0:
            raise PerceptionError("gaze must have a direction, got a vector of length 0")
        gx, gy, gz = gx / length, gy / length, gz / length
        x, y, z = target_m[0] - apex_m[0], target_m[1] - apex_m[1], target_m[2] - apex_m[2]
        axial = x * gx + z * gz + y * gy
        if not axial > 0.0:
            return 0.0
        x, y, z = x - axial * gx, y - axial * gy, z - axial * gz
        perpendicular = math.sqrt(x * x + z * z + y * y)
        radius = axial * math.tan(self.half_angle_rad)
        score = 1.0 - perpendicular / radius if perpendicular <= radius else 0.0
        if up is None or self.raised_rad is None or score == 0.0:
            return score
        ux, uy, uz = up
        along = ux * gx + uz * gz + uy * gy
        ux, uy, uz = ux - along * gx, uy - along * gy, uz - along * gz
        length = math.sqrt(ux * ux + uz * uz + uy * uy)
        if not length > 0.0:
            raise PerceptionError("up must have a direction off the gaze, got none")
        first, second = self.raised_rad
        raised = math.atan2((x * ux + z * uz + y * uy) / length, axial)
        return score * min(1.0, max(0.0, (second - raised) / (second - first)))

    def shares(self, ahead: FloatArray, above: FloatArray) -> FloatArray:
        """Return what a lowered head leaves of α for a target so far ahead and above the gaze."""
        if self.raised_rad is None:
            return np.ones_like(above)
        first, second = self.raised_rad
        share = (second - np.arctan2(above, ahead)) / (second - first)
        return np.asarray(np.minimum(np.maximum(share, 0.0), 1.0))


def _unit(name: str, vectors: FloatArray) -> FloatArray:
    """Return unit vectors (…, 3); PerceptionError for one without a direction."""
    length = np.sqrt(_dot(vectors, vectors))
    if not np.all(length > 0.0):
        raise PerceptionError(f"{name} must have a direction, got a vector of length 0")
    return np.asarray(vectors / length[..., None])


def _dot(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return dot products of (…, 3) arrays under broadcasting."""
    return np.asarray(np.einsum("...i,...i->...", first, second))


# Standard normal distribution in two dimensions on a regular grid (trapezoidal rule). The score has
# kinks on the axis and at the edge of the cone, where linear propagation fails and a Gauss–Hermite
# rule is coarse. The grid is finer in the plane of gaze and robot, where the edge is crossed.
_IN_PLANE: Final = np.linspace(-4.0, 4.0, 25)
_OUT_OF_PLANE: Final = np.linspace(-3.5, 3.5, 15)
_NODES: Final = np.stack(
    [axis.ravel() for axis in np.meshgrid(_OUT_OF_PLANE, _IN_PLANE, indexing="ij")], axis=0
)
_DENSITY: Final = np.exp(-0.5 * np.sum(_NODES**2, axis=0))
_WEIGHTS: Final = _DENSITY / _DENSITY.sum()
# Distances below this count as this.
_MIN_DISTANCE_M: Final = 0.1
# Components of a cross product: x from y and z, y from z and x, z from x and y.
_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])
_TURNING_SIGNS: Final = np.array([[-1.0], [1.0]])


@dataclass(frozen=True, slots=True)
class AwarenessEstimate:
    """Awareness α of one person.

    Attributes:
        awareness: α in [0, 1].
        awareness_std: standard deviation of α, ≥ 0.
    """

    awareness: float
    awareness_std: float


def estimate_awareness(
    cone: AttentionCone,
    heads: Sequence[HeadPose],
    robot_points_camera_m: FloatArray,
    *,
    extra_std_rad: FloatArray,
    eye_in_head_std_rad: tuple[float, float],
    face_seen: FloatArray,
    eyes: Sequence[EyeGaze | None] = (),
) -> tuple[AwarenessEstimate, ...]:
    """Return the awareness of each of N people.

    * α is the score of the head's direction and of how far it is lowered, or the expected score
      over the errors of the head pose if that is lower (near the axis). So uncertainty lowers α and
      never raises it.
    * The standard deviation is the root mean square difference between α and the person's true
      score, over the errors of the head pose and over the directions of the eyes in the head.
    * Where the eyes are measured, they are combined with how eyes turn in heads. The gaze is then
      that of the eyes, and α is lowered by the uncertainty of both, head and eyes.
    * With probability 1 − ``face_seen`` the camera sees no face. A person whose face the camera
      cannot see does not see the camera: then the score is 0, whatever the head pose says. α and
      its standard deviation are the moments of both cases together.

    Args:
        cone: the attention cone.
        heads: N head poses in the camera frame.
        robot_points_camera_m: (M, 3) points of the robot in the camera frame.
        extra_std_rad: (N,) standard deviation to add to each of the two angles of the gaze, see
            :class:`~perception.evidence.FaceEvidence`.
        eye_in_head_std_rad: standard deviations of the eyes in the head, sideways and up and down.
        face_seen: (N,) probabilities that the camera sees the face.
        eyes: eyes in each head as :func:`~perception.eyes.known_eyes` returns them, None where they
            are not known; empty if no eyes are known.
    """
    if not heads:
        return ()
    measured = [row for row, each in enumerate(eyes) if each is not None]
    lines = _LinesOfSight(tuple(heads), robot_points_camera_m, eyes)
    nominal = cone_scores(cone, lines.cosines, lines.sines).max(axis=1)
    head_covariance = lines.pose_covariance() + (extra_std_rad**2)[:, None, None] * np.eye(2)
    gaze_covariance = head_covariance + lines.eye_covariance(eye_in_head_std_rad)
    if measured:
        head_covariance[measured] += lines.measured_eye_covariance(eyes)
        gaze_covariance[measured] = head_covariance[measured]
    means, squares = _moments(cone, lines, np.array([head_covariance, gaze_covariance]))
    head_mean, (gaze_mean, gaze_square) = means[0], (means[1], squares[1])
    alpha = face_seen * np.minimum(nominal, head_mean)
    variance = face_seen * (gaze_square - 2.0 * alpha * gaze_mean) + alpha**2
    std = np.sqrt(np.maximum(variance, 0.0))
    return tuple(
        AwarenessEstimate(*pair) for pair in zip(alpha.tolist(), std.tolist(), strict=True)
    )


def cone_scores(cone: AttentionCone, cosines: FloatArray, sines: FloatArray) -> FloatArray:
    """Return α of unit vectors to the robot, whose parts along gaze and up are given."""
    edge = math.cos(cone.half_angle_rad)
    inside = np.minimum(np.maximum(cosines, edge), 1.0)
    tangent = np.sqrt(1.0 - inside * inside) / inside
    scores = np.maximum(1.0 - tangent / math.tan(cone.half_angle_rad), 0.0)
    return np.asarray(scores * cone.shares(cosines, sines))


class _LinesOfSight:
    """Lines of sight from the eyes of N heads to M points, and small rotations of the gazes.

    A small rotation moves a gaze in two directions (N, 3): ``normal`` is out of the plane of gaze
    and nearest line of sight, ``across`` lies in this plane.
    """

    def __init__(
        self,
        heads: tuple[HeadPose, ...],
        points: FloatArray,
        eyes: Sequence[EyeGaze | None] = (),
    ) -> None:
        self._rotation = np.array([head.rotation_camera_head for head in heads])
        self._covariance = np.array([head.covariance for head in heads])
        self._arm = self._rotation @ EYES_HEAD_M
        # From here on the axes of the gaze: those of the head, turned where eyes are measured.
        for row, each in enumerate(eyes):
            if each is not None:
                self._rotation[row] = self._rotation[row] @ each.rotation_head_eyes
        gaze = self._rotation[:, :, 1]
        apex = self._arm + np.array([head.position_camera_m for head in heads])
        offset = points - apex[:, None]
        distance = np.maximum(np.sqrt((offset * offset).sum(axis=2)), 1e-9)
        sight = offset / distance[..., None]
        #: (N, M) cosines of the angles between gazes and lines of sight
        self.cosines = (sight @ gaze[:, :, None])[..., 0]
        up = -self._rotation[:, :, :1]
        #: (N, M) components of the lines of sight along the heads' up direction
        self.sines = (sight @ up)[..., 0]
        rows, best = np.arange(len(heads)), self.cosines.argmax(axis=1)
        self._distance = np.maximum(distance[rows, best], _MIN_DISTANCE_M)
        nearest = sight[rows, best]
        normal = _cross(gaze, nearest)
        sine = np.sqrt((normal * normal).sum(axis=1))[:, None]
        # If the gaze points straight at the robot or away from it, any plane through it will do.
        straight = sine < 1e-9
        normal = np.where(straight, self._rotation[:, :, 0], normal / np.maximum(sine, 1e-9))
        #: (N, 2, 3) ``normal`` and ``across``
        self._axes = np.empty((len(heads), 2, 3))
        self._axes[:, 0], self._axes[:, 1] = normal, _cross(normal, gaze)
        #: (N, 2) components of the heads' up direction along ``normal`` and ``across``
        self.up = (self._axes @ up)[..., 0]
        self._sight_axes = np.empty_like(self._axes)
        self._sight_axes[:, 0], self._sight_axes[:, 1] = normal, _cross(normal, nearest)
        #: (N, 2, 3) derivatives of the gaze along ``normal`` and ``across`` with respect to a small
        #: rotation vector δ: normal · (δ × gaze) = −across · δ, across · (δ × gaze) = normal · δ
        self._turning = self._axes[:, ::-1] * _TURNING_SIGNS
        #: (N, 2, M) components of the lines of sight along ``normal`` and ``across``
        self.components = self._axes @ sight.swapaxes(1, 2)

    def pose_covariance(self) -> FloatArray:
        """Return (N, 2, 2) covariances of the gaze relative to the line of sight, from the pose."""
        # A small rotation δ moves the gaze by δ × gaze and the apex by δ × arm. A shift of the apex
        # turns the line of sight the other way.
        jacobian = np.empty((len(self._arm), 2, 6))
        sight = self._sight_axes / self._distance[:, None, None]
        jacobian[..., 3:] = sight
        jacobian[..., :3] = self._turning - _cross(sight, self._arm[:, None])
        return np.asarray(jacobian @ self._covariance @ jacobian.swapaxes(1, 2))

    def eye_covariance(self, std_rad: tuple[float, float]) -> FloatArray:
        """Return (N, 2, 2) covariances of the gaze from eye movements in the head.

        The eyes turn sideways about the head's x axis, and up and down about its z axis.
        """
        axes = self._turning @ (self._rotation[:, :, ::2] * std_rad)
        return np.asarray(axes @ axes.swapaxes(1, 2))

    def measured_eye_covariance(self, eyes: Sequence[EyeGaze | None]) -> FloatArray:
        """Return (K, 2, 2) covariances of the gaze from the K pairs of eyes that are known."""
        rows = [row for row, each in enumerate(eyes) if each is not None]
        covariance = np.array([each.covariance_rad2 for each in eyes if each is not None])
        # Rotation vectors of yaw and pitch: about the head's up axis −x and its right axis z.
        axes = self._turning[rows] @ (self._rotation[rows][:, :, ::2] * [-1.0, 1.0])
        return np.asarray(axes @ covariance @ axes.swapaxes(1, 2))


def _cross(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return cross products (…, 3); several times faster than ``np.cross`` on a few rows."""
    return np.asarray(
        first[..., _NEXT] * second[..., _LAST] - first[..., _LAST] * second[..., _NEXT]
    )


def _moments(
    cone: AttentionCone, lines: _LinesOfSight, covariance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return mean and mean square (…, N) of the highest score over normal errors of the gaze.

    ``covariance`` (…, N, 2, 2) is that of the gaze along ``normal`` and ``across``.
    """
    first = np.sqrt(np.maximum(covariance[..., 0, 0], 0.0))
    shared = covariance[..., 1, 0] / np.where(first > 0.0, first, 1.0)
    second = np.sqrt(np.maximum(covariance[..., 1, 1] - shared**2, 0.0))
    out = first[..., None] * _NODES[0]
    within = shared[..., None] * _NODES[0] + second[..., None] * _NODES[1]
    angle = np.maximum(np.sqrt(out * out + within * within), 1e-12)
    cosine, sine = np.cos(angle), np.sin(angle)
    out, within = out / angle, within / angle
    # The gaze turns towards (out, within), and the head's up direction turns with it.
    lean = out * lines.up[:, :1] + within * lines.up[:, 1:]
    highest = np.zeros_like(out)
    for point in range(lines.cosines.shape[1]):
        aside = lines.components[:, :, point, None]
        straight = lines.cosines[:, point, None]
        there = out * aside[:, 0] + within * aside[:, 1]
        above = lines.sines[:, point, None] - lean * ((1.0 - cosine) * there + sine * straight)
        scores = cone_scores(cone, cosine * straight + sine * there, above)
        highest = np.maximum(highest, scores)
    return highest @ _WEIGHTS, (highest * highest) @ _WEIGHTS
