"""Films of the gallery: each shipped scenario once, from above, as an animated WebP.

    python -m tools.docs_site.films                # all scenarios, into docs/images/films
    python -m tools.docs_site.films blind_corner   # one

The robot has the recommended set-up, a camera ahead and two laser scanners, and drives with the
policy ``balanced`` and seed 0. Films run at twice the real speed. Those of docs/policies.md and
docs/test_your_nav2.md (``asking_*.webp``, ``nav2.webp``) are by this module of commit 3030439d.
"""

from __future__ import annotations

import argparse
import dataclasses
import io
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import matplotlib as mpl
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from sim_tests import CrossingFrame, run_crossing, shipped_scenarios
from sim_tests.crossing import Stage, TopView
from sim_tests.scenario import SCENARIO_SETS

FOLDER: Final = Path(__file__).parents[2] / "docs" / "images" / "films"
#: Largest film, and largest sum of all films.
MAX_FILM_BYTES: Final = 150_000
MAX_SUM_BYTES: Final = 5_350_000

#: Films of the home page, which have a still for readers who do not want motion.
_WITH_STILL: Final = ("crossing_attentive", "crossing_distracted")
_WIDTH_PX: Final = 440
_MAX_HEIGHT_PX: Final = 260
_CAPTION_PX: Final = 22
_MARGINS_M: Final = (1.0, 2.8)
#: People who stand this near the robot's start or goal are in the picture.
_GROUP_M: Final = 3.0
_EVERY_S: Final = 0.25
_SPEED_UP: Final = 2.0
#: The last picture stays this long before the film begins again.
_REST_MS: Final = 1500
_COLOURS: Final = (64, 32)
_QUALITIES: Final = (40, 25, 15, 8)
_INK: Final = (34, 36, 42)
_PAPER: Final = (246, 245, 242)


class Film:
    """The pictures of one crossing; an observer of ``run_crossing``."""

    def __init__(self) -> None:
        self.pictures: list[Image.Image] = []
        self._view: TopView | None = None
        self._next_s = 0.0
        font = Path(mpl.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
        self._font = ImageFont.truetype(str(font), 12)

    def __call__(self, frame: CrossingFrame, stage: Stage) -> None:
        """Draw the frame if it is time for the next picture."""
        if self._view is None:
            window = _window(stage)
            height = round(_WIDTH_PX * (window[3] - window[1]) / (window[2] - window[0]))
            self._view = TopView(stage, (_WIDTH_PX, min(height, _MAX_HEIGHT_PX)), window)
        self._view.watch(frame)
        if frame.t_s < self._next_s - 1e-9:
            return
        self._next_s += _EVERY_S
        # The points of the scans flicker, and would make up most of the file.
        calm = dataclasses.replace(frame, scan_points_odom_m=np.zeros((0, 2)))
        picture = Image.fromarray(self._view.draw(calm, stage))
        self.pictures.append(self._captioned(picture, frame))

    def _captioned(self, picture: Image.Image, frame: CrossingFrame) -> Image.Image:
        """Return the picture with a line of figures below."""
        whole = Image.new("RGB", (picture.width, picture.height + _CAPTION_PX), _PAPER)
        whole.paste(picture)
        draw = ImageDraw.Draw(whole)
        constraints, place = frame.constraints, frame.robot_state.position_odom_m
        row = picture.height + 4
        speeds = (
            f"{frame.t_s:4.1f} s   robot {frame.robot_state.speed_mps:.1f} m/s, "
            f"limit {constraints.speed_limit_mps:.1f}"
        )
        draw.text((8, row), speeds, fill=_INK, font=self._font)
        if constraints.obstacles:
            nearest = min(
                constraints.obstacles, key=lambda o: float(np.hypot(*(o.center_odom_m - place)))
            )
            text = f"nearest: α ≥ {nearest.awareness_lower:.1f}, radius {nearest.radius_m:.1f} m"
            draw.text((picture.width - 8, row), text, fill=_INK, font=self._font, anchor="ra")
        return whole

    def webp(self) -> bytes:
        """Return the film, with fewer colours, quality or pictures where it would be too large."""
        for every in (1, 2):
            pictures = self.pictures[::every]
            for colours in _COLOURS:
                film = _encoded([_reduced(each, colours) for each in pictures], every)
                if len(film) <= MAX_FILM_BYTES:
                    return film
            for quality in _QUALITIES:
                film = _encoded(pictures, every, lossless=False, quality=quality)
                if len(film) <= MAX_FILM_BYTES:
                    return film
        return film


def _reduced(picture: Image.Image, colours: int) -> Image.Image:
    return picture.quantize(colours, dither=Image.Dither.NONE).convert("RGB")


def _encoded(
    pictures: list[Image.Image], every: int, *, lossless: bool = True, quality: int = 70
) -> bytes:
    step_ms = round(1000.0 * every * _EVERY_S / _SPEED_UP)
    durations = [step_ms] * (len(pictures) - 1) + [_REST_MS]
    stream = io.BytesIO()
    pictures[0].save(
        stream,
        "WEBP",
        save_all=True,
        append_images=pictures[1:],
        duration=durations,
        loop=0,
        lossless=lossless,
        quality=quality,
        method=4,
    )
    return stream.getvalue()


def _window(stage: Stage) -> tuple[float, float, float, float]:
    """Return x_min, y_min, x_max, y_max (m) of the robot's way and what is beside it."""
    task = stage.scenario.robot
    ends = np.array([(task.start_x_m, task.start_y_m), (task.goal_x_m, task.goal_y_m)])
    margins = _MARGINS_M if np.argmax(np.ptp(ends, axis=0)) == 0 else _MARGINS_M[::-1]
    places = [each.route[0] for each in stage.scenario.people if len(each.route) == 1]
    standing = np.array([(place.x_m, place.y_m) for place in places]).reshape(-1, 2)
    apart = np.linalg.norm(standing[:, None] - ends, axis=2).min(axis=1)
    group = np.vstack([ends, standing[apart < _GROUP_M]])
    low = np.minimum(ends.min(axis=0) - margins, group.min(axis=0) - _MARGINS_M[0])
    high = np.maximum(ends.max(axis=0) + margins, group.max(axis=0) + _MARGINS_M[0])
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def filmed_scenarios() -> tuple[str, ...]:
    """Return the names of the shipped scenarios of all sets."""
    return tuple(name for each in SCENARIO_SETS for name in shipped_scenarios(each))


def main(arguments: Sequence[str] | None = None) -> int:
    """Make the films; return 1 if they are too large."""
    parser = argparse.ArgumentParser(description="Make the films of the gallery.")
    parser.add_argument("scenarios", nargs="*", help="default: all that are shipped")
    names = parser.parse_args(arguments).scenarios or filmed_scenarios()
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in names:
        film = Film()
        run_crossing(name, policy="balanced", perception="keypoints+scanner", seed=0, observer=film)
        data = film.webp()
        (FOLDER / f"{name}.webp").write_bytes(data)
        if name in _WITH_STILL:
            still = film.pictures[len(film.pictures) // 2].quantize(_COLOURS[0])
            still.save(FOLDER / f"{name}.png", optimize=True)
        print(f"{name}: {len(film.pictures)} pictures, {len(data) / 1e3:.0f} kB", flush=True)
    total = sum(path.stat().st_size for path in FOLDER.glob("*.webp"))
    print(f"all films: {total / 1e6:.2f} MB of at most {MAX_SUM_BYTES / 1e6:.2f} MB")
    return int(total > MAX_SUM_BYTES)


if __name__ == "__main__":
    sys.exit(main())
