"""Scenery fills its collision boxes, stays in the hall, carries its textures, and never changes."""

from __future__ import annotations

import numpy as np
import pytest
from triangle_hits import shares_met

from sim_tests import SimError
from sim_tests.world.hall import (
    BOX_FACES,
    LAYOUTS,
    PROP_PARTS,
    TEXTURE_NAMES,
    Mesh,
    Prop,
    RackBox,
    SceneryChunk,
    WarehouseLayout,
    box,
    merge,
    scenery,
    scenery_texture,
)

_VARIANTS = (0, pytest.param(6, marks=pytest.mark.full))
_HALL = {"x_min_m": -9.0, "y_min_m": -9.0, "x_max_m": 9.0, "y_max_m": 9.0}
# A mesh may stick out of its collision box by this much.
_TOLERANCE_M = 0.03


def _bytes(chunks: tuple[SceneryChunk, ...]) -> bytes:
    return b"".join(
        chunk.mesh.vertices_m.tobytes()
        + chunk.mesh.indices.tobytes()
        + np.asarray(chunk.mesh.uv).tobytes()
        + repr((chunk.colour, chunk.texture)).encode()
        for chunk in chunks
    )


def _mesh_on_the_floor(layout: WarehouseLayout) -> Mesh:
    """Return the racks and props of a layout, without the ceiling's beams and lamps."""
    return merge(
        chunk.mesh
        for chunk in scenery(layout)
        if chunk.texture == "goods0" and chunk.mesh.vertices_m[:, 2].min() < 0.5
    )


def _hits(mesh: Mesh, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return (N,) whether segments meet a triangle from either side."""
    corners = mesh.vertices_m[mesh.indices.reshape(-1, 3)]
    met = (shares_met(corners, *pair) for pair in zip(starts, ends - starts, strict=True))
    return np.array([((each >= -1e-9) & (each <= 1.0 + 1e-9)).any() for each in met])


def _on_face(
    rng: np.random.Generator, low: np.ndarray, high: np.ndarray, face: int, margin_m: float
) -> np.ndarray:
    """Return a point on face 0 to 3 (−x, +x, −y, +y) or 4 (+z) of a box, away from its rim."""
    point = rng.uniform(low + margin_m, high - margin_m)
    axis = face // 2
    point[axis] = high[axis] if face in (1, 3, 4) else low[axis]
    return point


@pytest.mark.parametrize("name", LAYOUTS)
@pytest.mark.parametrize("variant", _VARIANTS)
def test_chunks_are_well_formed_and_stay_inside_the_hall(name: str, variant: int) -> None:
    layout = WarehouseLayout.named(name)
    chunks = scenery(layout, variant)
    for chunk in chunks:
        mesh = chunk.mesh
        assert mesh.uv is not None
        assert mesh.uv.shape == (len(mesh.vertices_m), 2)
        assert mesh.uv.min() >= 0.0
        assert mesh.uv.max() <= 1.0
        np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-6)
        assert all(0.0 <= share <= 1.0 for share in chunk.colour)
        assert chunk.texture in TEXTURE_NAMES
        low, high = mesh.vertices_m.min(axis=0), mesh.vertices_m.max(axis=0)
        assert (low >= np.array([layout.x_min_m, layout.y_min_m, 0.0]) - 1e-9).all()
        inner = np.array([layout.x_max_m, layout.y_max_m, layout.wall_height_m])
        assert (high <= inner + 1e-9).all()
        # Chunks are small enough that a view leaves most of a hall out.
        assert np.linalg.norm(high - low) < 9.0
        corners = mesh.vertices_m[mesh.indices.reshape(-1, 3)]
        facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = np.linalg.norm(facing, axis=1)
        assert area.min() > 1e-8
        shaded = mesh.normals[mesh.indices.reshape(-1, 3)].mean(axis=1)
        outward = np.einsum("ij,ij->i", facing, shaded) > 0.0
        # Only the ceiling and its lamps face down with normals that point up.
        overhead = corners[:, :, 2].min(axis=1) > layout.wall_height_m - 0.5
        assert (outward | (overhead & (facing[:, 2] < 0.0))).all()


def test_the_same_hall_and_variant_give_the_same_bytes() -> None:
    layout = WarehouseLayout.named("staging_hall")
    first = _bytes(scenery(layout, 3))
    scenery.cache_clear()
    assert _bytes(scenery(layout, 3)) == first
    assert _bytes(scenery(layout, 4)) != first
    with pytest.raises(SimError, match="variant must be"):
        scenery(layout, -1)


@pytest.mark.parametrize(
    "rack",
    [
        RackBox(x_m=1.0, y_m=-2.0, length_m=7.8, width_m=1.1),
        RackBox(x_m=0.0, y_m=3.0, length_m=1.1, width_m=5.0),
        RackBox(x_m=0.0, y_m=0.0, length_m=2.0, width_m=0.7, height_m=2.2),
    ],
)
def test_a_rack_blocks_every_ray_and_does_not_stick_out(rack: RackBox) -> None:
    mesh = _mesh_on_the_floor(WarehouseLayout(**_HALL, racks=(rack,)))
    x_min, y_min, x_max, y_max = rack.box_odom_m
    low, high = np.array([x_min, y_min, 0.0]), np.array([x_max, y_max, rack.height_m])
    assert (mesh.vertices_m >= low - _TOLERANCE_M).all()
    assert (mesh.vertices_m <= high + _TOLERANCE_M).all()
    rng = np.random.default_rng(5)
    pairs = [(a, b) for a in range(5) for b in range(5) if a != b]
    chords = [pairs[k % len(pairs)] for k in range(300)]
    starts = np.array([_on_face(rng, low, high, a, 0.01) for a, _ in chords])
    ends = np.array([_on_face(rng, low, high, b, 0.01) for _, b in chords])
    assert _hits(mesh, starts, ends).all()


@pytest.mark.parametrize("kind", PROP_PARTS)
@pytest.mark.parametrize("yaw_deg", [90.0, 217.0])
def test_a_prop_fills_its_boxes_and_does_not_stick_out(kind: str, yaw_deg: float) -> None:
    prop = Prop(kind=kind, x_m=1.0, y_m=-2.0, yaw_deg=yaw_deg)
    mesh = _mesh_on_the_floor(WarehouseLayout(**_HALL, props=(prop,)))
    boxes, heights = np.array(prop.boxes_odom_m), np.array(prop.heights_m)
    x, y, z = mesh.vertices_m.T[:, :, None]
    inside = (
        (x >= boxes[:, 0] - _TOLERANCE_M)
        & (x <= boxes[:, 2] + _TOLERANCE_M)
        & (y >= boxes[:, 1] - _TOLERANCE_M)
        & (y <= boxes[:, 3] + _TOLERANCE_M)
        & (z >= -1e-9)
        & (z <= heights + _TOLERANCE_M)
    )
    assert inside.any(axis=1).all()
    assert mesh.vertices_m[:, 2].max() > heights.max() - 0.06
    if yaw_deg == 217.0:  # the axis-aligned box is larger than the rotated prop
        return
    rng = np.random.default_rng(6)
    for around, height in zip(boxes, heights, strict=True):
        low, high = np.array([*around[:2], 0.0]), np.array([*around[2:], height])
        if height < 0.4:  # forks, which are lower than any line of sight
            continue
        starts = rng.uniform(low, high, (120, 3))
        ends = starts.copy()
        axis = np.arange(120) % 2
        rows = np.arange(120)
        starts[rows, axis], ends[rows, axis] = low[axis], high[axis]
        assert _hits(mesh, starts, ends).mean() > 0.8, (kind, around)


@pytest.mark.parametrize("face", BOX_FACES[:4])
def test_a_texture_stands_upright_on_each_side_of_a_box(face: str) -> None:
    side = box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), {face: (0.25, 0.5, 0.75, 1.0)})
    assert side.uv is not None
    assert side.triangles == 2
    axis, sign = "xyz".index(face[1]), 1.0 if face[0] == "+" else -1.0
    outward = np.zeros(3)
    outward[axis] = sign
    np.testing.assert_array_equal(side.vertices_m[:, axis], 0.5 * sign)
    np.testing.assert_array_equal(side.normals, np.tile(outward, (4, 1)))
    right = np.cross([0.0, 0.0, 1.0], outward)  # to the right, seen from outside
    np.testing.assert_allclose(side.uv[:, 0], 0.5 + 0.5 * side.vertices_m @ right, atol=1e-12)
    np.testing.assert_allclose(side.uv[:, 1], 0.75 + 0.5 * side.vertices_m[:, 2], atol=1e-12)


def test_shipped_textures_are_read_only_and_known_by_name() -> None:
    for name in TEXTURE_NAMES:
        assert not scenery_texture(name).flags.writeable
    with pytest.raises(SimError, match="did you mean 'goods0'"):
        scenery_texture("good0")
