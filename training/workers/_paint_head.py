"""Colour of skin, eyes and hair, texel by texel."""

from __future__ import annotations

from typing import Final

import numpy as np

from ._atlas import Samples
from ._head import beard_mask
from ._noise import Noise
from ._person import Person
from ._piece import Array, smoothstep

#: Places on the average face: eyes (±y, z), mouth line, brow line.
_EYE_Y_M: Final = 0.0313
_EYE_Z_M: Final = 1.7205
_MOUTH_Z_M: Final = 1.648
_BROW_Z_M: Final = 1.7425
#: Phenotype age from which a face has lines.
_LINED_AGE: Final = 0.74


def skin(s: Samples, person: Person, noise: Noise) -> Array:
    """Return the skin of face, neck, arms and hands."""
    mottle = 0.025 * noise.layered(s.canon_m, 0.05) + 0.012 * noise(s.canon_m, 0.004)
    rgb: Array = np.array(person.skin, dtype=np.float64) * (1.0 + mottle)[:, None]
    if s.label != "face":
        return rgb
    face = _Face(s, person, noise, rgb)
    for step in (face.flush, face.shadows, face.mouth, face.nose, face.eyes, face.brows):
        step()
    if person.beard > 0.0:
        face.beard()
    if person.phenotype["age"] > _LINED_AGE:
        face.lines()
    return face.rgb


class _Face:
    """Features painted over skin, one after the other."""

    def __init__(self, s: Samples, person: Person, noise: Noise, rgb: Array) -> None:
        self.rgb = rgb
        self._canon, self._noise, self._person = s.canon_m, noise, person
        self._x, self._y, self._z = s.canon_m.T
        self._side = np.abs(self._y)
        self._front = smoothstep(self._x, 0.06, 0.09)
        self._base = np.array(person.skin, dtype=np.float64)
        self._hair = np.array(person.hair_colour, dtype=np.float64)
        self._woman = person.phenotype["gender"] > 0.5

    def _blend(self, over: Array, share: Array) -> None:
        self.rgb += (over - self.rgb) * np.clip(share, 0.0, 1.0)[:, None]

    def flush(self) -> None:
        """Redden cheeks, tip of the nose and ears."""
        side, z = self._side, self._z
        red = self._base * [1.02, 0.80, 0.78]
        cheeks = np.exp(-(((side - 0.042) / 0.018) ** 2) - ((z - 1.685) / 0.016) ** 2)
        nose = np.exp(-((side / 0.012) ** 2) - ((z - 1.690) / 0.012) ** 2)
        self._blend(red, 0.38 * self._front * np.maximum(cheeks, 0.8 * nose))
        self._blend(red, 0.35 * smoothstep(side, 0.072, 0.080) * smoothstep(self._x, -0.02, 0.0))

    def shadows(self) -> None:
        """Darken the orbits and the place under the lower lip."""
        side, z = self._side, self._z
        orbit = np.exp(-(((side - 0.026) / 0.018) ** 2) - ((z - 1.727) / 0.012) ** 2)
        self._blend(self._base * 0.72, 0.45 * self._front * orbit)
        under = np.exp(-(((z - 1.632) / 0.005) ** 2) - (side / 0.018) ** 2)
        self._blend(self._base * 0.78, 0.5 * self._front * under)

    def mouth(self) -> None:
        """Paint lips, the dark line between them, and the inside of the mouth."""
        side, z = self._side, self._z
        upper = (z - _MOUTH_Z_M) / (0.0095 - 0.10 * side)
        lower = (_MOUTH_Z_M - z) / (0.0115 - 0.12 * side)
        wide = smoothstep(side, 0.027, 0.022)
        tone = self._base * ([0.84, 0.57, 0.61] if self._woman else [0.82, 0.66, 0.66])
        lips = smoothstep(np.maximum(upper, lower), 1.05, 0.75) * wide
        self._blend(tone, 0.80 * self._front * lips)
        line = np.exp(-(((z - _MOUTH_Z_M + 4.0 * side**2) / 0.0014) ** 2)) * wide
        self._blend(self._base * [0.40, 0.28, 0.26], 0.85 * self._front * line)
        behind = (
            (side < 0.026) & (np.abs(z - _MOUTH_Z_M) < 0.02) & (self._x < 0.1345 - 6.0 * side**2)
        )
        self._blend(self._base * [0.30, 0.20, 0.19], behind * smoothstep(self._x, 0.05, 0.08))

    def nose(self) -> None:
        """Paint nostrils and the crease about the wings."""
        hole = np.hypot((self._side - 0.0085) / 0.0048, (self._z - 1.6765) / 0.0030)
        dark = 0.9 * self._front * smoothstep(hole, 1.1, 0.7) * smoothstep(self._x, 0.11, 0.12)
        self._blend(self._base * [0.35, 0.25, 0.22], dark)
        wing = np.hypot((self._side - 0.0175) / 0.004, (self._z - 1.683) / 0.009)
        self._blend(self._base * 0.76, 0.5 * self._front * smoothstep(wing, 1.2, 0.6))

    def eyes(self) -> None:
        """Paint lash lines about the eyes."""
        above = self._z > _EYE_Z_M
        lid = np.hypot(
            (self._side - _EYE_Y_M) / 0.0165, (self._z - _EYE_Z_M) / np.where(above, 0.0068, 0.0056)
        )
        dark = (0.9 if self._woman else 0.7) * np.where(above, 1.0, 0.55)
        self._blend(self._base * 0.22, dark * self._front * np.exp(-(((lid - 1.0) / 0.14) ** 2)))

    def brows(self) -> None:
        """Paint brows that rise and thin outwards."""
        along = (self._side - 0.012) / 0.042
        inner = np.clip(along, 0.0, 1.0)
        arch = _BROW_Z_M + 0.006 * np.sin(inner * 2.3) - 0.003 * along
        wide = (0.0036 if self._woman else 0.0052) * (1.15 - 0.65 * inner)
        brow = smoothstep(np.abs(self._z - arch) / wide, 1.25, 0.6)
        brow *= smoothstep(along, -0.06, 0.08) * smoothstep(along, 1.02, 0.85)
        brow *= 0.85 + 0.25 * self._noise(self._canon, (0.002, 0.0015, 0.004))
        self._blend(self._hair * 0.75 + self._base * 0.06, 0.88 * self._front * brow)

    def beard(self) -> None:
        """Paint anything from stubble to a full beard."""
        grain = 0.85 + 0.3 * self._noise(self._canon, (0.004, 0.004, 0.008))
        grown = min(1.0, 0.35 + 0.65 * self._person.beard) * beard_mask(self._canon) * grain
        self._blend(self._hair * 0.85 + self._base * 0.12, grown)

    def lines(self) -> None:
        """Paint lines of age on the forehead and from the nose to the mouth."""
        side, z = self._side, self._z
        brow = (np.abs(np.sin((z - 1.75) / 0.013 * np.pi)) > 0.985) * smoothstep(z, 1.752, 1.757)
        self._blend(self._base * 0.82, 0.5 * self._front * brow * smoothstep(side, 0.045, 0.03))
        fold = np.exp(-((((z - 1.672) + 1.25 * (side - 0.026)) / 0.0025) ** 2))
        near = smoothstep(np.abs(z - 1.667), 0.018, 0.010)
        self._blend(self._base * 0.80, 0.5 * self._front * fold * near)


def eye(s: Samples, person: Person) -> Array:
    """Return white, iris and pupil by the angle to the eye's axis."""
    x, y, z = s.canon_m.T
    away = np.hypot(y, z) / np.maximum(np.linalg.norm(s.canon_m, axis=1), 1e-9)
    ahead = x > 0.0
    rgb = np.tile(np.array([232.0, 228.0, 222.0]), (len(x), 1))
    rgb *= (1.0 - 0.16 * smoothstep(away, 0.55, 0.95))[:, None]
    rgb *= (1.0 - 0.22 * smoothstep(z, 0.002, 0.008))[:, None]
    dark = sum(person.skin) < 520
    iris = np.array([62.0, 40.0, 26.0]) if dark else np.array([92.0, 104.0, 108.0])
    rgb = np.where((ahead & (away < 0.50))[:, None], iris * 0.55, rgb)
    rgb = np.where((ahead & (away < 0.44))[:, None], iris, rgb)
    rgb = np.where((ahead & (away < 0.21))[:, None], 12.0, rgb)
    glint = np.hypot(y / 0.0142 - 0.16, z / 0.0142 - 0.20) < 0.09
    shining: Array = np.where((ahead & glint)[:, None], 250.0, rgb)
    return shining


def hair(s: Samples, person: Person, noise: Noise) -> Array:
    """Return strands that run down from the crown."""
    x, y, z = s.canon_m.T
    base = np.array(person.hair_colour, dtype=np.float64)
    around = np.arctan2(y, -(x - 0.0))
    strand = np.column_stack([np.cos(around), np.sin(around), 0.18 * z / 0.1])
    light = 1.0 + 0.16 * noise(strand, 0.10) + 0.10 * noise(strand, 0.035)
    light += 0.06 * noise.layered(s.canon_m, 0.03)
    if person.hair == "crop":
        light = 1.0 + 0.14 * noise(s.canon_m, 0.006)
    sheen = 0.22 * np.clip(s.normals[:, 2], 0.0, 1.0) ** 2
    rgb: Array = base * light[:, None] + 40.0 * sheen[:, None]
    return np.clip(rgb, 4.0, 255.0)
