"""Textured meshes of few triangles from fine pieces: simplify, unwrap, bake."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np
import pyfqmr
import trimesh
import xatlas
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from ._cloth import open_edges
from ._noise import Shade
from ._piece import Array, Piece, Triangles, vertex_normals

#: Texels per length, relative to cloth.
_SHARPNESS: Final = {
    "face": 2.6,
    "eye": 3.2,
    "skin": 1.3,
    "glove": 1.2,
    "hair": 1.3,
    "glasses": 0.8,
    "sock": 0.5,
    "sole": 0.6,
}
#: Distance that a difference in normals counts as: separates the two sides of thin cloth.
_NORMAL_M: Final = 0.05
_CREASE_COS: Final = np.cos(np.radians(60.0))
_PADDING_PX: Final = 4
_OVERSAMPLING: Final = 2
#: Largest change of a weight along an edge, by level of detail.
_STEPS: Final = (0.4, 0.5, 0.8)


@dataclass(frozen=True, eq=False)
class Baked:
    """A textured mesh."""

    vertices_m: Array
    normals: Array
    uv: Array
    triangles: Triangles
    weights: Array
    texture_rgb: NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Samples:
    """Places on a fine piece at which paint is evaluated.

    Attributes:
        label: material.
        points_m: (N, 3).
        canon_m: (N, 3) the same places on the average body or in the piece's own frame.
        normals: (N, 3).
        shade: (N,) factor on the colour.
        weights: (N, 16).
    """

    label: str
    points_m: Array
    canon_m: Array
    normals: Array
    shade: Array
    weights: Array


@dataclass(frozen=True, eq=False)
class Part:
    """A piece at one level of detail."""

    fine: Fine
    vertices_m: Array
    normals: Array
    triangles: Triangles
    weights: Array

    @property
    def sharpness(self) -> float:
        """Texels per length, relative to cloth."""
        return _SHARPNESS.get(self.fine.label, 1.0)


Paint = Callable[[Samples], Array]


class Fine:
    """A fine piece that can be sampled at any place."""

    def __init__(self, piece: Piece, shade: Shade) -> None:
        spacing = 0.003 if piece.label in ("face", "eye") else 0.008
        vertices, triangles, fields = piece.vertices_m, piece.triangles, piece
        attributes = np.column_stack([fields.canon_m, fields.weights, piece.normals()])
        for _ in range(3):
            edges = vertices[triangles] - vertices[np.roll(triangles, 1, axis=1)]
            if np.percentile(np.linalg.norm(edges, axis=-1), 90) < spacing:
                break
            both, triangles = trimesh.remesh.subdivide(
                np.column_stack([vertices, attributes]), triangles
            )
            vertices, attributes = both[:, :3], both[:, 3:]
        self.label = piece.label
        self._points = vertices
        self._canon, self._weights = attributes[:, :3], attributes[:, 3:19]
        normals = attributes[:, 19:]
        self._normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
        self._shade = shade(vertices, self._normals)
        self._tree = cKDTree(np.column_stack([vertices, _NORMAL_M * self._normals]))

    def at(self, points_m: Array, normals: Array) -> Samples:
        """Return samples at the nearest places, a mixture of three neighbours."""
        count = min(3, len(self._points))
        distance, rows = self._tree.query(
            np.column_stack([points_m, _NORMAL_M * normals]), k=count, workers=1
        )
        mix = 1.0 / (distance.reshape(len(points_m), count) ** 2 + 1e-9)
        mix /= mix.sum(axis=1, keepdims=True)
        rows = rows.reshape(len(points_m), count)

        def take(values: Array) -> Array:
            mixed: Array = np.einsum("nk,nk...->n...", mix, values[rows])
            return mixed

        return Samples(
            self.label,
            take(self._points),
            take(self._canon),
            take(self._normals),
            take(self._shade),
            # Mixing leaves traces of neighbours; weights are exactly 0 or 1 away from joints.
            np.clip((take(self._weights) - 0.01) / 0.98, 0.0, 1.0),
        )


def bake(pieces: list[Piece], fine: list[Fine], level: int, size_px: int, paint: Paint) -> Baked:
    """Simplify every piece to its budget at a level of detail and bake its paint."""
    parts: list[Part] = []
    for piece, samples in zip(pieces, fine, strict=True):
        if piece.budget[level] == 0:
            continue
        rough, faces = _refine(*_simplify(piece, piece.budget[level]), samples, _STEPS[level])
        follow = _settled(rough, faces, samples, _STEPS[level])
        rows, normals, triangles = _split_creases(rough, faces)
        vertices, weights = rough[rows], follow[rows]
        parts.append(Part(samples, vertices, normals, triangles, weights))
    return _assemble(parts, size_px, paint)


def _unwrap(parts: list[Part], size_px: int) -> tuple[Triangles, Triangles, Array]:
    """Lay the charts of all parts on one sheet, as large as possible.

    The library gets the parts as one mesh, because it sometimes crashes with several meshes.
    Returns rows of the concatenated vertices of the parts, triangles of those rows in the parts'
    order, and texture coordinates.
    """
    points = np.concatenate([part.vertices_m * part.sharpness for part in parts])
    normals = np.concatenate([part.normals for part in parts])
    shift = np.cumsum([0, *(len(part.vertices_m) for part in parts[:-1])])
    triangles = np.concatenate([part.triangles + at for part, at in zip(parts, shift, strict=True)])
    area = float(trimesh.triangles.area(points[triangles]).sum())
    fill = 0.72
    while fill > 0.05:
        atlas = xatlas.Atlas()
        atlas.add_mesh(
            points.astype(np.float32), triangles.astype(np.uint32), normals.astype(np.float32)
        )
        chart, pack = xatlas.ChartOptions(), xatlas.PackOptions()
        chart.max_cost = 6.0
        chart.normal_seam_weight = 1.0
        pack.resolution, pack.padding = size_px, _PADDING_PX if size_px > 256 else 2
        pack.texels_per_unit = float(np.sqrt(fill * size_px**2 / area))
        pack.create_image = False
        atlas.generate(chart, pack)
        if atlas.atlas_count == 1 and max(atlas.width, atlas.height) <= size_px:
            rows, index, uv = atlas[0]
            # The library normalises by its own sheet, which may be smaller than the texture.
            uv = uv.astype(np.float64) * [atlas.width / size_px, atlas.height / size_px]
            return rows.astype(np.int64), index.astype(np.int64).reshape(-1, 3), uv
        fill *= 0.88
    raise RuntimeError("the texture atlas does not fit on one sheet")


def _assemble(parts: list[Part], size_px: int, paint: Paint) -> Baked:
    """Unwrap all parts and paint them into one texture."""
    rows, triangles, uv = _unwrap(parts, size_px)
    points = np.concatenate([part.vertices_m for part in parts])[rows]
    normals = np.concatenate([part.normals for part in parts])[rows]
    weights = np.concatenate([part.weights for part in parts])[rows]
    # Painted finer, then reduced: the renderer takes the nearest texel, so edges must be smooth.
    fine_px = size_px * (_OVERSAMPLING if size_px > 300 else 2 * _OVERSAMPLING)
    picture = np.zeros((fine_px, fine_px, 3))
    known = np.zeros((fine_px, fine_px), dtype=bool)
    start = 0
    for part in parts:
        faces = triangles[start : start + len(part.triangles)]
        start += len(part.triangles)
        at, place, up = _texels(uv, faces, points, normals, fine_px)
        if len(at):
            picture[at[:, 0], at[:, 1]] = paint(part.fine.at(place, up))
            known[at[:, 0], at[:, 1]] = True
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
    picture = picture[nearest[0], nearest[1]].astype(np.float32)
    picture = cv2.resize(picture, (size_px, size_px), interpolation=cv2.INTER_AREA)
    rgb = np.clip(np.round(picture), 0, 255).astype(np.uint8)
    return Baked(points, normals, uv, triangles, weights, rgb)


def _texels(
    uv: Array, triangles: Triangles, points: Array, normals: Array, size_px: int
) -> tuple[NDArray[np.int64], Array, Array]:
    """Return the texels of all charts, grown by half a texel, with their places and normals."""
    corner = np.column_stack([uv[:, 0], 1.0 - uv[:, 1]]) * size_px - 0.5
    owner = np.full((size_px, size_px), -1, dtype=np.int32)
    for row, triangle in enumerate(triangles):
        polygon = np.round(corner[triangle] * 16.0).astype(np.int32)
        cv2.fillConvexPoly(owner, polygon, row, shift=4)
        cv2.polylines(owner, [polygon], True, row, shift=4)
    v, u = np.nonzero(owner >= 0)
    face = triangles[owner[v, u]]
    a, b, c = (corner[face[:, k]] for k in range(3))
    ab, ac, ap = b - a, c - a, np.column_stack([u, v]) - a
    area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    area = np.where(np.abs(area) < 1e-9, 1e-9, area)
    s = (ap[:, 0] * ac[:, 1] - ap[:, 1] * ac[:, 0]) / area
    t = (ab[:, 0] * ap[:, 1] - ab[:, 1] * ap[:, 0]) / area
    share = np.clip(np.column_stack([1.0 - s - t, s, t]), 0.0, 1.0)
    share /= share.sum(axis=1, keepdims=True)
    place = np.einsum("nk,nkc->nc", share, points[face])
    up = np.einsum("nk,nkc->nc", share, normals[face])
    return np.column_stack([v, u]), place, up


def with_lip(piece: Piece) -> Piece:
    """Return the piece with its open edges folded inwards."""
    if piece.lip_m == 0.0:
        return piece
    edges = open_edges(piece.triangles)
    rows, index = np.unique(edges, return_inverse=True)
    rim, normals = piece.vertices_m[rows], piece.normals()[rows]
    a, b = rows[index.reshape(-1, 2)].T
    below_a, below_b = index.reshape(-1, 2).T + len(piece.vertices_m)
    strip = np.concatenate([np.stack([b, a, below_a], 1), np.stack([b, below_a, below_b], 1)])
    return replace(
        piece,
        vertices_m=np.concatenate([piece.vertices_m, rim - piece.lip_m * normals]),
        triangles=np.concatenate([piece.triangles, strip]),
        weights=np.concatenate([piece.weights, piece.weights[rows]]),
        canon_m=np.concatenate([piece.canon_m, piece.canon_m[rows]]),
    )


def _simplify(piece: Piece, budget: int) -> tuple[Array, Triangles]:
    """Reduce a piece to a budget of triangles by quadric edge collapse."""
    if len(piece.triangles) <= budget:
        return piece.vertices_m, piece.triangles
    for aggressiveness in (3, 5, 7, 9):
        simplifier = pyfqmr.Simplify()
        simplifier.setMesh(piece.vertices_m, piece.triangles.astype(np.int32))
        simplifier.simplify_mesh(
            target_count=budget, aggressiveness=aggressiveness, preserve_border=False, verbose=False
        )
        vertices, triangles, _ = simplifier.getMesh()
        if len(triangles) < 1.15 * budget:
            break
    return np.asarray(vertices, dtype=np.float64), np.asarray(triangles, dtype=np.int64)


def _refine(
    vertices: Array, triangles: Triangles, samples: Fine, step: float
) -> tuple[Array, Triangles]:
    """Halve the edges along which a joint's weight changes by more than ``step``."""
    for _ in range(3):
        weights = samples.at(vertices, vertex_normals(vertices, triangles)).weights
        ends = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1), axis=-1)
        edges, rows = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
        steep = np.abs(weights[edges[:, 0]] - weights[edges[:, 1]]).max(axis=1) > step
        if not steep.any():
            break
        middle = np.full(len(edges), -1)
        middle[steep] = len(vertices) + np.arange(steep.sum())
        vertices = np.concatenate([vertices, vertices[edges[steep]].mean(axis=1)])
        split = middle[rows.reshape(-1, 3)]
        made = [triangles[(split < 0).all(axis=1)]]
        for corner, cut in zip(triangles, split, strict=True):
            count = int((cut >= 0).sum())
            if count == 0:
                continue
            # Rotate the triangle so that the odd edge comes first.
            turn = int(np.argmax(cut >= 0)) if count == 1 else int(np.argmin(cut >= 0))
            a, b, c = (int(corner[(turn + k) % 3]) for k in range(3))
            ab, bc, ca = (int(cut[(turn + k) % 3]) for k in range(3))
            if count == 1:
                made.append(np.array([(a, ab, c), (ab, b, c)]))
            elif count == 2:
                made.append(np.array([(a, b, bc), (a, bc, ca), (ca, bc, c)]))
            else:
                made.append(np.array([(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]))
        triangles = np.concatenate(made)
    return vertices, triangles


def _settled(vertices: Array, triangles: Triangles, samples: Fine, step: float) -> Array:
    """Return weights from the fine piece, corrected where the nearest place is on another limb."""
    weights = samples.at(vertices, vertex_normals(vertices, triangles)).weights
    one, other = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    a, b = np.concatenate([one, other]), np.concatenate([other, one])
    for _ in range(12):
        steep = np.abs(weights[a] - weights[b]).max(axis=1) > step + 0.05
        if not steep.any():
            break
        total, count = np.zeros_like(weights), np.zeros((len(vertices), 1))
        np.add.at(total, a, weights[b])
        np.add.at(count, a, 1.0)
        rows = np.unique(a[steep])
        weights[rows] = 0.5 * weights[rows] + 0.5 * total[rows] / count[rows]
    return weights


def _split_creases(vertices: Array, triangles: Triangles) -> tuple[Triangles, Array, Triangles]:
    """Double vertices along sharp edges.

    Returns the original row and the normal of each new vertex (smooth except across sharp edges),
    and the triangles.
    """
    corners = vertices[triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(area, axis=1, keepdims=True)
    triangles, area, size = (
        triangles[size[:, 0] > 1e-12],
        area[size[:, 0] > 1e-12],
        size[size > 1e-12],
    )
    flat = area / size[:, None]
    corner_vertex = triangles.ravel()
    corner_face = np.repeat(np.arange(len(triangles)), 3)
    order = np.argsort(corner_vertex, kind="stable")
    bounds = np.searchsorted(corner_vertex[order], np.arange(len(vertices) + 1))
    normals = np.zeros((len(corner_vertex), 3))
    for vertex in range(len(vertices)):
        at = order[bounds[vertex] : bounds[vertex + 1]]
        if not len(at):
            continue
        faces = corner_face[at]
        near = flat[faces] @ flat[faces].T > _CREASE_COS
        normals[at] = near @ area[faces]
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    key = np.column_stack([corner_vertex, np.round(normals * 50.0)]).astype(np.int64)
    _, first, index = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return corner_vertex[first], normals[first], index.reshape(-1, 3)


def shade_of(pieces: list[Piece], *, forearms: bool) -> Shade:
    """Return the shade between the pieces; hips get none from the hands, which move away."""
    rng = np.random.default_rng(0)
    clouds = []
    for piece in pieces:
        far = piece.weights[:, [5, 8]].max(axis=1) > 0.5
        kept = piece.triangles if forearms else piece.triangles[~far[piece.triangles].any(axis=1)]
        if len(kept):
            clouds.append(_sample(trimesh.Trimesh(piece.vertices_m, kept, process=False), rng))
    return Shade(np.concatenate(clouds))


def _sample(mesh: trimesh.Trimesh, rng: np.random.Generator) -> Array:
    """Return random points on a surface, about four per square centimetre."""
    count = int(mesh.area * 4.0e4)
    face = np.searchsorted(np.cumsum(mesh.area_faces) / mesh.area, rng.random(count)).clip(
        0, len(mesh.faces) - 1
    )
    a, b = rng.random((2, count, 1))
    a, b = np.where(a + b > 1, 1 - a, a), np.where(a + b > 1, 1 - b, b)
    corners = mesh.vertices[mesh.faces[face]]
    points: Array = (
        corners[:, 0] + a * (corners[:, 1] - corners[:, 0]) + b * (corners[:, 2] - corners[:, 0])
    )
    return points
