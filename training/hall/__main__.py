"""Command ``python -m training.hall``: make the textures and meshes of ``sim_tests``."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from sim_tests.world.hall import Mesh

from . import atlases, base_pieces, prop_meshes, robot_meshes, textures

_PACKAGE: Final = Path(__file__).parents[2] / "sim_tests"
# OpenCV writes WebP without loss above a quality of 100.
_LOSSLESS: Final = (cv2.IMWRITE_WEBP_QUALITY, 101)


def main() -> None:
    """Write all textures, the places of the cells of the atlases, and all meshes."""
    parser = argparse.ArgumentParser(prog="python -m training.hall", description=__doc__)
    parser.add_argument(
        "--out", type=Path, default=_PACKAGE, help="folder of sim_tests (default: %(default)s)"
    )
    out: Path = parser.parse_args().out
    hall, robot = out / "world" / "hall", out / "actors" / "robot"
    folder = hall / "textures"
    for each in (folder, robot):
        each.mkdir(parents=True, exist_ok=True)
    for name, texture in textures():
        path = folder / f"{name}.webp"
        if not cv2.imwrite(str(path), np.ascontiguousarray(texture[..., ::-1]), _LOSSLESS):
            parser.exit(1, f"cannot write {path}\n")
        print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")
    (folder / "atlases.json").write_text(json.dumps(atlases(), indent=1) + "\n", encoding="utf-8")
    write_meshes(hall / "props.npz", prop_meshes())
    # The triangles of each piece of the base, for lines of sight.
    counts = [mesh.triangles for mesh in base_pieces()]
    write_meshes(robot / "nova_carter.npz", robot_meshes(), base_piece_triangles=np.array(counts))


def write_meshes(path: Path, meshes: Mapping[str, Mesh], **arrays: Any) -> None:
    """Write meshes by name to a file for ``sim_tests.world.hall.read_meshes``."""
    for name, mesh in meshes.items():
        arrays |= {f"{name}.{each.name}": getattr(mesh, each.name) for each in fields(mesh)}
    np.savez_compressed(path, **arrays)
    print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
