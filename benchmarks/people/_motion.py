"""Tracks of people, sampled and smoothed alike, and the quantities that are read from them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np
from scipy.signal import savgol_filter

from perception.arrays import FloatArray

from .._recordings import places_together, walks_of

#: Rate of the recordings; simulated people are sampled at the same rate.
RATE_HZ: Final = 29.97
#: Savitzky-Golay filter of all derivatives: frames of the window, and order of the polynomial.
WINDOW: Final = 15
ORDER: Final = 3
# Directions of slower people are noise.
_WALKING_MPS: Final = 0.3
_SECOND: Final = 30  # frames
# Lateral sway: the band of the stride.
_SWAY_HZ: Final = (0.7, 1.2)
_SWAY_FRAMES: Final = 150
# Somebody slower than the first speed stands; walking is reached at this share of the median speed.
_STANDING_MPS: Final = 0.2
_REACHED_SHARE: Final = 0.8
# Pairs that pass within this distance have met.
_MET_M: Final = 3.0
_HORIZON_S: Final = 3.0


@dataclass(frozen=True)
class Scene:
    """People who were tracked together.

    Attributes:
        positions_m: (people, frames, 2) positions on the floor at :data:`RATE_HZ`.
        vehicle: a vehicle drives among them.
    """

    positions_m: FloatArray
    vehicle: bool = False

    @cached_property
    def velocity_mps(self) -> FloatArray:
        """(people, frames, 2) smoothed velocities, without half a window at either end."""
        return self._derivative(1)

    @cached_property
    def acceleration_mps2(self) -> FloatArray:
        """(people, frames, 2) smoothed accelerations, without half a window at either end."""
        return self._derivative(2)

    @cached_property
    def place_m(self) -> FloatArray:
        """(people, frames, 2) positions at the frames of the velocities."""
        half = WINDOW // 2
        return self.positions_m[:, half:-half]

    @cached_property
    def speed_mps(self) -> FloatArray:
        """(people, frames) speeds."""
        return np.asarray(np.linalg.norm(self.velocity_mps, axis=2))

    def _derivative(self, order: int) -> FloatArray:
        half = WINDOW // 2
        found = savgol_filter(
            self.positions_m, WINDOW, ORDER, deriv=order, delta=1.0 / RATE_HZ, axis=1
        )
        return np.asarray(found[:, half:-half])


def read_scene(path: Path) -> Scene:
    """Return the people of a CSV of ``t_s, id, x_m, y_m``, while all of them are there."""
    _, places = places_together(walks_of(path), RATE_HZ)
    return Scene(places.transpose(1, 0, 2), vehicle="no_vehicle" not in path.name)


def noise_m(scenes: Sequence[Scene]) -> float:
    """Return the standard deviation of the white noise of positions, from fourth differences."""
    steps = [np.diff(scene.positions_m, 4, axis=1).ravel() for scene in scenes]
    return float(np.median(np.abs(np.concatenate(steps))) / 0.6745 / np.sqrt(70.0))


@dataclass(frozen=True)
class Quantity:
    """A quantity of people's motion.

    Attributes:
        name: its name in tables and files.
        unit: of its values.
        text: its description.
        of: returns its values in a scene.
    """

    name: str
    unit: str
    text: str
    of: Callable[[Scene], FloatArray]

    def values(self, scenes: Sequence[Scene]) -> FloatArray:
        """Return the values of all scenes."""
        return np.concatenate([np.zeros(0), *(self.of(scene) for scene in scenes)])


def _speed(scene: Scene, vehicle: bool) -> FloatArray:
    return scene.speed_mps.ravel() if scene.vehicle == vehicle else np.zeros(0)


def _along_across(scene: Scene) -> tuple[FloatArray, FloatArray]:
    v, a, speed = scene.velocity_mps, scene.acceleration_mps2, scene.speed_mps
    walking = speed > _WALKING_MPS
    along = (a * v).sum(axis=2)[walking] / speed[walking]
    across = (v[..., 0] * a[..., 1] - v[..., 1] * a[..., 0])[walking] / speed[walking]
    return along, across


def _turning(scene: Scene) -> FloatArray:
    _, across = _along_across(scene)
    return np.degrees(np.abs(across) / scene.speed_mps[scene.speed_mps > _WALKING_MPS])


def _heading_change(scene: Scene) -> FloatArray:
    v, speed = scene.velocity_mps, scene.speed_mps
    before, after = v[:, :-_SECOND], v[:, _SECOND:]
    turned = np.arctan2(
        before[..., 0] * after[..., 1] - before[..., 1] * after[..., 0], (before * after).sum(2)
    )
    walking = (speed[:, :-_SECOND] > _WALKING_MPS) & (speed[:, _SECOND:] > _WALKING_MPS)
    return np.degrees(np.abs(turned[walking]))


def _speed_change(scene: Scene) -> FloatArray:
    speed = scene.speed_mps
    return (speed[:, _SECOND:] - speed[:, :-_SECOND]).ravel()


def _deviation(scene: Scene, seconds: int) -> FloatArray:
    frames = seconds * _SECOND
    straight = scene.place_m[:, :-frames] + scene.velocity_mps[:, :-frames] * (frames / RATE_HZ)
    walking = scene.speed_mps[:, :-frames] > _WALKING_MPS
    off = np.linalg.norm(scene.place_m[:, frames:] - straight, axis=2)
    return np.asarray(off[walking])


def _gaps(scene: Scene) -> FloatArray:
    """Return (people, people, frames) distances, infinite to oneself."""
    place = scene.place_m
    gaps = np.linalg.norm(place[:, None] - place[None], axis=3)
    gaps[np.arange(len(place)), np.arange(len(place))] = np.inf
    return np.asarray(gaps)


def _nearest(scene: Scene) -> FloatArray:
    if len(scene.place_m) < 2:
        return np.zeros(0)
    nearest = _gaps(scene).min(axis=1)
    return np.asarray(nearest[scene.speed_mps > _WALKING_MPS])


def _passing(scene: Scene) -> FloatArray:
    """Return the least distance of each pair that meets and parts while it is seen."""
    gaps, found = _gaps(scene), []
    for one in range(len(gaps)):
        for other in range(one):
            at = int(gaps[one, other].argmin())
            inside = 0 < at < gaps.shape[2] - 1
            opposed = (scene.velocity_mps[one, at] * scene.velocity_mps[other, at]).sum() < 0.0
            if inside and opposed and gaps[one, other, at] < _MET_M:
                found.append(gaps[one, other, at])
    return np.array(found)


def _predicted_closest(scene: Scene) -> FloatArray:
    """Return predicted closest approaches of pairs that come nearer within the next seconds."""
    found = []
    for one in range(len(scene.place_m)):
        for other in range(one):
            d = scene.place_m[other] - scene.place_m[one]
            w = scene.velocity_mps[other] - scene.velocity_mps[one]
            squared = np.maximum((w * w).sum(axis=1), 1e-9)
            after_s = -(d * w).sum(axis=1) / squared
            least = np.linalg.norm(d + after_s[:, None] * w, axis=1)
            soon = (after_s > 0.0) & (after_s < _HORIZON_S) & (squared > 1.0) & (least < _MET_M)
            found.append(least[soon])
    return np.concatenate([np.zeros(0), *found])


def _sway(scene: Scene) -> FloatArray:
    """Return the amplitude of the lateral sway of each person who walks on."""
    found = []
    for place, speed in zip(scene.place_m, scene.speed_mps, strict=True):
        for start in range(0, len(place) - _SWAY_FRAMES + 1, _SWAY_FRAMES):
            piece = place[start : start + _SWAY_FRAMES]
            if speed[start : start + _SWAY_FRAMES].min() < 0.7:
                continue
            way = piece[-1] - piece[0]
            aside = (piece - piece[0]) @ (np.array([-way[1], way[0]]) / np.linalg.norm(way))
            t = np.linspace(-1.0, 1.0, _SWAY_FRAMES)
            aside = aside - np.polyval(np.polyfit(t, aside, 4), t)
            hann = np.hanning(_SWAY_FRAMES)
            spectrum = np.fft.rfft(aside * hann)
            hz = np.fft.rfftfreq(_SWAY_FRAMES, 1.0 / RATE_HZ)
            band = (hz >= _SWAY_HZ[0]) & (hz <= _SWAY_HZ[1])
            # A sine of amplitude A has the energy (A/2)² · N · sum(hann²) in its positive half.
            energy = float((np.abs(spectrum[band]) ** 2).sum())
            found.append(2.0 * np.sqrt(energy / (_SWAY_FRAMES * float((hann**2).sum()))))
    return np.array(found)


def _start_time(scene: Scene) -> FloatArray:
    """Return times from standing to 80 % of each person's own median walking speed."""
    found = []
    for speed in scene.speed_mps:
        walking = speed[speed > 2.0 * _WALKING_MPS]
        standing = np.flatnonzero(speed < _STANDING_MPS)
        if not len(standing) or not len(walking):
            continue
        after = np.flatnonzero(speed[standing[-1] :] > _REACHED_SHARE * np.median(walking))
        if len(after):
            found.append(after[0] / RATE_HZ)
    return np.array(found)


QUANTITIES: Final = (
    Quantity("speed_alone", "m/s", "walking speed, no vehicle", lambda s: _speed(s, False)),
    Quantity("speed_vehicle", "m/s", "walking speed, vehicle near", lambda s: _speed(s, True)),
    Quantity("along", "m/s²", "acceleration along the path", lambda s: _along_across(s)[0]),
    Quantity("across", "m/s²", "acceleration across the path", lambda s: _along_across(s)[1]),
    Quantity("turning", "°/s", "turning rate", _turning),
    Quantity("heading_change", "°", "change of heading within 1 s", _heading_change),
    Quantity("speed_change", "m/s", "change of speed within 1 s", _speed_change),
    Quantity("deviation_1s", "m", "off constant velocity after 1 s", lambda s: _deviation(s, 1)),
    Quantity("deviation_2s", "m", "off constant velocity after 2 s", lambda s: _deviation(s, 2)),
    Quantity("nearest", "m", "distance to the nearest other person", _nearest),
    Quantity("passing", "m", "least distance of two who meet", _passing),
    Quantity("closest", "m", "predicted distance at closest approach", _predicted_closest),
    Quantity("sway", "m", "amplitude of the lateral sway", _sway),
    Quantity("start_time", "s", "from standing to 80 % of walking speed", _start_time),
)
