"""The film of one crossing with three robots, side by side."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Final

import numpy as np

from awarenav.drawing import Font
from awarenav.video import VideoWriter
from perception.arrays import ImageRgb

from ..crossing import CrossingResult
from ._comparison import ComparisonRow
from ._film_panel import PANEL_PX, PANELS, draw_panel
from ._portraits import FILM_HZ

#: Time for which the last picture, with the results, is shown.
HOLD_S: Final = 4.0

_GAP_PX: Final = 12
_LEGEND_PX: Final = 34
_LEGEND: Final = (
    "circle: obstacle · cone: where the worker looks · outline: robot with nobody there"
    " · α: lower bound"
)
_LEGEND_FONT: Final = Font(24, weight=500)


def write_crossing_film(paths: Sequence[Path], rows: Sequence[ComparisonRow]) -> None:
    """Write the film of crossings side by side, in real time; each panel stands still at its end.

    Args:
        paths: files to write, each ``.webp`` (animated image) or ``.mp4``.
        rows: the comparison. The first row is the crossing with nobody there, against which time
            is lost; the film shows today's robot and the aware one with both workers.

    Raises:
        AwarenavError: for another kind of file.
    """
    free = rows[0].result
    shown = [row for row in rows if row.label in PANELS]
    with ExitStack() as stack:
        writers = [
            stack.enter_context(VideoWriter(path, FILM_HZ, film_size_px(len(shown))))
            for path in paths
        ]
        for picture in film_pictures(shown, free):
            for writer in writers:
                writer.add(picture)
        for writer in writers:
            for _ in range(round(HOLD_S * FILM_HZ) - 1):
                writer.add(picture)


def film_size_px(panels: int) -> tuple[int, int]:
    """Return width and height of a film, both even."""
    width = panels * (PANEL_PX[0] + _GAP_PX) + _GAP_PX
    height = PANEL_PX[1] + _GAP_PX + _LEGEND_PX
    return width + width % 2, height + height % 2


def film_pictures(rows: Sequence[ComparisonRow], free: CrossingResult) -> Iterator[ImageRgb]:
    """Yield the pictures of the film, from the start to the end of the longest crossing."""
    width, height = film_size_px(len(rows))
    end_s = max(row.result.frames[-1].t_s for row in rows)
    for number in range(math.ceil(end_s * FILM_HZ - 1e-6) + 1):
        image = np.full((height, width, 3), 255, np.uint8)
        for column, row in enumerate(rows):
            left = _GAP_PX + column * (PANEL_PX[0] + _GAP_PX)
            panel = draw_panel(row, free, number)
            image[_GAP_PX : _GAP_PX + PANEL_PX[1], left : left + PANEL_PX[0]] = panel
        _LEGEND_FONT.write(image, _LEGEND, (_GAP_PX + 8, height - _LEGEND_PX), (96, 100, 110))
        yield image
