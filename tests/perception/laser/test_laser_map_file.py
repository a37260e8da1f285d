"""Maps in the format of map_server: what counts as occupied, where it lies, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from laser_scenes import laser_scan, points_of

from perception import PerceptionError
from perception.laser import LegDetector, LegDetectorConfig, MapCells

KEYS = {
    "image": "hall.pgm",
    "resolution": 0.1,
    "origin": "[-1.0, -2.0, 0.0]",
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}


def written(folder: Path, pixels: np.ndarray | bytes, name: str = "hall.pgm", **keys) -> Path:
    """Write a map and return its YAML file; a key with the value None is left out."""
    image = pixels if isinstance(pixels, bytes) else cv2.imencode(name[-4:], pixels)[1].tobytes()
    (folder / name).write_bytes(image)
    lines = {**KEYS, "image": name, **keys}
    path = folder / "hall.yaml"
    path.write_text("".join(f"{k}: {v}\n" for k, v in lines.items() if v is not None))
    return path


def middles(pixels: np.ndarray, side: float = 0.1) -> np.ndarray:
    """Return the place (K, 2) of each marked pixel, from the lower left corner of the image."""
    row, column = np.nonzero(pixels)
    return np.column_stack((column + 0.5, len(pixels) - row - 0.5)) * side


def test_the_lowest_row_of_the_image_lies_at_the_origin(tmp_path: Path) -> None:
    pixels = np.full((4, 6), 254, np.uint8)
    pixels[3, 0] = pixels[0, 5] = 0  # lower left, upper right
    cells = MapCells.from_yaml(written(tmp_path, pixels)).cells_m
    np.testing.assert_allclose(cells, [[-0.95, -1.95], [-0.45, -1.65]])


@pytest.mark.parametrize(
    ("keys", "occupied"),
    [
        # Black counts as occupied from a share of 0.65 on: 255 · 0.35 = 89.25.
        ({}, [0, 89]),
        ({"mode": "trinary"}, [0, 89]),
        ({"negate": 1}, [166, 205, 206, 254, 255]),
        ({"negate": "true", "occupied_thresh": 0.9}, [254, 255]),
        # 65 per cent of the way from 0.196 to 0.65 is a share of 0.491, a brightness of 129.8.
        ({"mode": "scale"}, [0, 89, 90, 100, 129]),
        # The brightness itself, from 0 to 100, is the occupancy.
        ({"mode": "raw"}, [89, 90, 100]),
        ({"mode": "raw", "negate": 1}, [89, 90, 100]),
    ],
)
def test_brightness_counts_as_the_mode_says(keys, occupied, tmp_path: Path) -> None:
    values = np.array([[0, 89, 90, 100, 129, 131, 166, 205, 206, 254, 255]], np.uint8)
    for name in ("hall.pgm", "hall.png", "hall.bmp"):
        cells = MapCells.from_yaml(written(tmp_path, values, name, **keys))
        columns = np.floor((cells.cells_m[:, 0] + 1.0) / 0.1).astype(int)
        assert values[0, columns].tolist() == occupied, name
    deep = written(tmp_path, values.astype(np.uint16) * 257, "deep.png", **keys)
    assert len(MapCells.from_yaml(deep).cells_m) == len(occupied)


@pytest.mark.parametrize(
    ("keys", "kind"), [({}, np.uint8), ({"mode": "raw"}, np.uint8), ({"negate": 1}, np.uint16)]
)
def test_transparent_pixels_are_unknown(keys: dict[str, object], kind: type, tmp_path) -> None:
    """As for nav2_map_server since 2025; where somebody stands is then no part of the map."""
    white, dark = np.iinfo(kind).max, {"raw": 90}.get(str(keys.get("mode")), 0)
    pixels = np.full((1, 4, 4), white if "negate" in keys else dark * (white // 255), kind)
    pixels[0, :, 3] = [white, white // 2, 0, white]
    cells = MapCells.from_yaml(written(tmp_path, pixels, "a.png", **keys))
    np.testing.assert_allclose(cells.cells_m[:, 0], [-0.95, -0.65])


@pytest.mark.parametrize("kind", [2, 3, 5, 6])
def test_netpbm_is_read_as_text_and_as_numbers(kind: int, tmp_path: Path) -> None:
    shades = np.array([[0, 255, 255], [255, 255, 0]])
    values = np.repeat(shades, 3, axis=1) if kind in (3, 6) else shades
    head = b"P%d\n# by hand\n3 # wide\n2\n255\n" % kind
    body = b"\n".join(b" ".join(b"%d" % v for v in row) for row in values) + b"\n"
    if kind in (5, 6):
        body = values.astype(np.uint8).tobytes()
    cells = MapCells.from_yaml(written(tmp_path, head + body, "hall.pnm")).cells_m
    np.testing.assert_allclose(cells, [[-0.75, -1.95], [-0.95, -1.85]])


@settings(max_examples=15, deadline=None)
@given(
    st.integers(0, 10_000),
    st.tuples(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0), st.floats(-3.1, 3.1)),
    st.floats(-3.1, 3.1),
)
def test_a_turned_map_holds_its_cells_wherever_it_lies(
    tmp_path_factory, seed: int, origin: tuple[float, float, float], yaw: float
) -> None:
    """The yaw of the file's origin and the pose of the map in odom compose."""
    rng = np.random.default_rng(seed)
    walls = rng.random((9, 14)) < 0.1
    path = written(
        tmp_path_factory.mktemp("map"),
        np.where(walls, 0, 254).astype(np.uint8),
        origin=list(origin),
    )
    T = np.eye(4)
    T[:2, :2] = [[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]]
    T[:2, 3] = 3.0, -4.0
    turn = origin[2]
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])

    def in_odom(places: np.ndarray) -> np.ndarray:
        return (places @ rotation.T + origin[:2]) @ T[:2, :2].T + T[:2, 3]

    places = middles(walls)
    held = MapCells.from_yaml(path).near(T, in_odom(middles(walls | True)).mean(axis=0), 1.0)
    assert held.holds(in_odom(places)).all()
    # Every point of an occupied cell belongs to it, though its cells are drawn anew.
    for corner in (-0.049, 0.049):
        assert held.holds(in_odom(places + np.array([corner, -corner]))).all()
    free = middles(~walls)
    if len(places):
        away = np.linalg.norm(free[:, None] - places, axis=2).min(axis=1)
        free = free[away > 0.1 * (1.0 + 2.5 * math.sqrt(2.0))]
    assert not held.holds(in_odom(free)).any()


def test_a_post_on_the_map_is_nobody(tmp_path: Path) -> None:
    """Two posts a step apart look like legs; the one map that has them says otherwise."""
    posts = [(2.0, 0.1, 0.06), (2.0, -0.1, 0.06)]
    points = points_of(laser_scan(posts))
    once = LegDetectorConfig(learn=False)
    assert len(LegDetector(once).detect(points)) == 1
    pixels = np.full((40, 50), 254, np.uint8)
    for x, y, _ in posts:
        row, column = len(pixels) - 1 - round((y + 2.0) / 0.1 - 0.5), round((x + 1.0) / 0.1 - 0.5)
        pixels[row - 1 : row + 2, column - 1 : column + 2] = 0
    known = MapCells.from_yaml(written(tmp_path, pixels)).near(np.eye(4), np.zeros(2), 5.0)
    assert LegDetector(once, static_map=known).detect(points) == ()


WHITE = np.full((2, 2), 255, np.uint8)


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"resolution": None}, "lacks the key 'resolution'"),
        ({"occupied_tresh": 0.6}, "unknown key 'occupied_tresh'.*did you mean 'occupied_thresh'"),
        ({"mode": "binary"}, "mode must be one of trinary, scale, raw, got 'binary'"),
        ({"resolution": 0.0}, r"resolution must lie in \[0.005, 1\]"),
        ({"origin": "[0, 0]"}, r"origin must have shape \(3,\)"),
        ({"origin": "[0, 0, .nan]"}, "origin must be finite"),
        ({"negate": 2}, "negate must be 0 or 1"),
        ({"occupied_thresh": 1.1}, "occupied_thresh must lie in"),
        ({"occupied_thresh": 0.1}, "free_thresh must be below occupied_thresh, got 0.196 and 0.1"),
        ({"image": "gone.pgm"}, "cannot read the map's image .*gone.pgm: No such file"),
        ({"image": "[]"}, "image must be the path"),
    ],
)
def test_a_map_file_that_makes_no_sense_is_refused(keys, text: str, tmp_path: Path) -> None:
    path = written(tmp_path, WHITE, **{"image": "hall.pgm", **keys})
    with pytest.raises(PerceptionError, match=text) as raised:
        MapCells.from_yaml(path)
    assert str(tmp_path) in str(raised.value)
    path.write_text("[1, 2]\n")
    with pytest.raises(PerceptionError, match=r"hall\.yaml must hold the keys image, resolution"):
        MapCells.from_yaml(path)


def test_other_keys_are_not_read_and_a_warning_names_them(tmp_path: Path, caplog) -> None:
    """As map_server does; tools that draw maps add keys of their own."""
    path = written(tmp_path, WHITE, cost_scaling=1, image_type="grid", resolution="5e-2")
    assert MapCells.from_yaml(path).resolution_m == 0.05
    assert caplog.messages == [f"{path}: not read: 'cost_scaling', 'image_type'"]


@pytest.mark.parametrize(
    ("image", "text"),
    [
        (b"", "damaged, or no PGM"),
        (b"P5 3 1 255\n\x00\x32", "damaged, or no PGM"),
        (b"P5 9999999 9999999 255\n", "damaged, or no PGM"),
        (b"P5 2 1 100\n\x00\x64", "in which white is 100, not 255 or 65535; save it as PGM or PNG"),
        (b"\x89PNG" + bytes(22) + b"tRNS", "a grey PNG with a transparent grey; save it as"),
        (b"II*\0" + bytes(30), "a TIFF; save it as PGM or PNG"),
        (b"P7\nWIDTH 1\nHEIGHT 1\nDEPTH 1\nMAXVAL 15\nENDHDR\n\x0f", r"a PAM \(P7\); save it as"),
    ],
)
def test_a_damaged_image_is_refused(image: bytes, text: str, tmp_path: Path) -> None:
    with pytest.raises(PerceptionError, match=text):
        MapCells.from_yaml(written(tmp_path, image))


@settings(max_examples=15, deadline=None)
@given(st.binary(max_size=40), st.integers(0, 60), st.sampled_from([".pgm", ".png", ".bmp"]))
def test_damage_to_an_image_never_crashes(
    tmp_path_factory, noise: bytes, at: int, kind: str
) -> None:
    data = bytearray(cv2.imencode(kind, np.full((5, 7), 100, np.uint8))[1].tobytes())
    data[at : at + len(noise)] = noise
    path = written(tmp_path_factory.mktemp("map"), bytes(data), "hall" + kind)
    try:
        found = MapCells.from_yaml(path)
    except PerceptionError:
        return
    assert np.isfinite(found.cells_m).all()
