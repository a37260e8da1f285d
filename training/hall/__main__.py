"""Command ``python -m training.hall``: paint the textures that ship with ``sim_tests``."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from . import atlases, textures

_FOLDER: Final = Path(__file__).parents[2] / "sim_tests" / "world" / "hall" / "textures"
# OpenCV writes WebP without loss above a quality of 100.
_LOSSLESS: Final = (cv2.IMWRITE_WEBP_QUALITY, 101)


def main() -> None:
    """Write all textures, and the places of the cells of the atlases."""
    parser = argparse.ArgumentParser(prog="python -m training.hall", description=__doc__)
    parser.add_argument("--out", type=Path, default=_FOLDER, help="folder (default: %(default)s)")
    out: Path = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    for name, texture in textures():
        path = out / f"{name}.webp"
        if not cv2.imwrite(str(path), np.ascontiguousarray(texture[..., ::-1]), _LOSSLESS):
            parser.exit(1, f"cannot write {path}\n")
        print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")
    lines = json.dumps(atlases(), indent=1)
    (out / "atlases.json").write_text(lines + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
