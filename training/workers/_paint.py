"""Colour of cloth, shoes and hats, texel by texel."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ._atlas import Samples
from ._noise import Noise
from ._paint_head import eye, hair, skin
from ._person import Person
from ._piece import Array, smoothstep

_SILVER = np.array([206.0, 208.0, 206.0])


class Painter:
    """Paint of one worker; places are those of the average body."""

    def __init__(self, person: Person, rng: np.random.Generator) -> None:
        self._person = person
        self._noise = Noise(rng)
        self._by_label: dict[str, Callable[[Samples], Array]] = {
            "face": lambda s: skin(s, person, self._noise),
            "skin": lambda s: skin(s, person, self._noise),
            "eye": lambda s: eye(s, person),
            "hair": lambda s: hair(s, person, self._noise),
            "top": self._top,
            "collar": self._collar,
            "vest": self._vest,
            "trousers": self._trousers,
            "sock": lambda s: _flat(s, (60, 60, 64)),
            "glove": self._glove,
            "shoe": self._shoe,
            "sole": lambda s: _flat(s, (42, 40, 38)),
            "cap": self._cap,
            "helmet": self._helmet,
            "brim": lambda s: _flat(s, person.headwear[1]) * 0.94,
            "glasses": lambda s: _flat(s, (34, 32, 32)),
        }

    def __call__(self, samples: Samples) -> Array:
        """Return colours (N, 3), RGB in 0–255."""
        rgb = self._by_label[samples.label](samples)
        shaded: Array = rgb * samples.shade[:, None]
        return shaded

    def _cloth(self, s: Samples, rgb: Array, folds: float, weave: float = 0.025) -> Array:
        """Return cloth with folds, across the limbs near the joints and hanging elsewhere."""
        canon = s.canon_m
        fine = self._noise(canon, 0.004) * weave + 0.015 * self._noise.layered(canon, 0.15)
        bent = np.zeros(len(canon))
        for joint in (5, 8, 11, 14):
            # Cloth creases where the skin bends, most where the weight is in between.
            share = s.weights[:, joint]
            bent += 4.0 * share * (1.0 - share)
        waist = smoothstep(np.abs(canon[:, 2] - 1.02), 0.14, 0.0)
        across = self._ridges(canon, (0.13, 0.13, 0.030)) * (0.25 + 1.3 * bent + 0.8 * waist)
        hanging = self._ridges(canon, (0.045, 0.045, 0.26))
        crease = np.tanh(0.8 * across + 0.5 * hanging)
        light = 1.0 + folds * crease + fine
        # Light comes from above: surfaces that face down are darker.
        light *= 1.0 + 0.05 * s.normals[:, 2]
        shaded: Array = rgb * light[:, None]
        return shaded

    def _ridges(self, canon: Array, wavelength_m: tuple[float, float, float]) -> Array:
        """Return noise with narrow dark valleys between broad bright folds."""
        ridged: Array = 0.9 - 1.6 * np.exp(-(((self._noise(canon, wavelength_m)) / 0.45) ** 2))
        return ridged

    def _base(self, s: Samples, colour: tuple[int, int, int]) -> Array:
        return np.tile(np.array(colour, dtype=np.float64), (len(s.canon_m), 1))

    def _top(self, s: Samples) -> Array:
        person = self._person
        x, y, z = s.canon_m.T
        rgb = self._base(s, person.top_colour)
        trim = np.array(person.top_trim, dtype=np.float64)
        if person.top == "checked":
            around = np.arctan2(y, x + 0.01) * 0.17
            one = np.mod(z / 0.055, 1.0) < 0.45
            two = np.mod(around / 0.055, 1.0) < 0.45
            rgb = np.where((one ^ two)[:, None], 0.5 * (rgb + trim), rgb)
            rgb = np.where((one & two)[:, None], trim, rgb)
            thin = (np.mod(z / 0.055, 1.0) > 0.70) & (np.mod(z / 0.055, 1.0) < 0.76)
            rgb = np.where(thin[:, None], 0.6 * rgb + 90.0, rgb)
        front = (x > 0.05) & (np.abs(y) < 0.16) & (z > 0.9)
        if person.top in ("shirt", "checked"):
            placket = front & (np.abs(y) < 0.016)
            rgb[placket] *= 0.94
            buttons = front & (np.hypot(y, np.mod(z, 0.09) - 0.045) < 0.0055)
            rgb[buttons] = 0.5 * trim + 90.0
            rgb[front & (np.abs(np.abs(y) - 0.017) < 0.0012)] *= 0.75
            self._pocket(rgb, s, 0.075, 1.33, 0.05, 0.06)
        if person.top == "polo":
            placket = front & (np.abs(y) < 0.014) & (z > 1.42)
            rgb[placket] = 0.8 * trim
            sleeve_end = (s.weights[:, 4] + s.weights[:, 7] > 0.5) & (z < 1.275)
            rgb[sleeve_end] = trim
        if person.top in ("hoodie", "jacket"):
            zip_line = front & (np.abs(y) < 0.004)
            rgb[zip_line] = (150, 150, 148)
            rgb[front & (np.abs(np.abs(y) - 0.012) < 0.0015)] *= 0.7
            hem = (z < 0.925) & (s.weights[:, 4] + s.weights[:, 7] < 0.3)
            rgb[hem] *= 0.86
            slot = front & (np.abs((np.abs(y) - 0.085) - 0.35 * (1.06 - z)) < 0.004)
            rgb[slot & (z < 1.12) & (z > 0.97)] *= 0.55
        if person.top == "overalls":
            bib = (z < 1.34) & (np.abs(y) < 0.155 - 0.045 * smoothstep(z, 1.10, 1.26)) & (x > 0.0)
            back = (x <= 0.0) & (z < 1.16 + 0.25 * (0.13 - np.abs(y)))
            low = (z < 1.09) & (s.weights[:, 4] + s.weights[:, 7] < 0.3)
            strap = (np.abs(np.abs(y) - 0.085) < 0.020) & (z > 1.15)
            worn = (bib | back | low | strap) & (s.weights[:, 4] + s.weights[:, 7] < 0.5)
            rgb[worn] = trim
            edge = (np.abs(z - 1.34) < 0.003) & bib
            rgb[edge] *= 0.7
            buckle = (x > 0.0) & (np.abs(np.abs(y) - 0.085) < 0.018) & (np.abs(z - 1.32) < 0.014)
            rgb[buckle] = (168, 160, 130)
            self._pocket(rgb, s, 0.0, 1.25, 0.055, 0.05)
        return self._cloth(s, rgb, 0.10 if person.top in ("hoodie", "jacket") else 0.085)

    def _collar(self, s: Samples) -> Array:
        person = self._person
        rgb = self._base(s, person.top_trim if person.top == "polo" else person.top_colour)
        if person.top == "checked":
            trim = np.array(person.top_trim, dtype=np.float64)
            around = np.mod(np.arctan2(s.canon_m[:, 1], s.canon_m[:, 0]) / 0.32, 1.0) < 0.45
            rgb = np.where(around[:, None], 0.5 * (rgb + trim), rgb)
        return self._cloth(s, rgb, 0.03)

    @staticmethod
    def _pocket(
        rgb: Array, s: Samples, y_m: float, z_m: float, half_m: float, depth_m: float
    ) -> None:
        """Paint the stitched outline of a patch pocket on the chest."""
        x, y, z = s.canon_m.T
        inside = np.maximum(np.abs(y - y_m) - half_m, np.abs(z - z_m) - depth_m)
        rgb[(np.abs(inside) < 0.0018) & (x > 0.03)] *= 0.72
        rgb[(np.abs(z - z_m - depth_m + 0.014) < 0.0012) & (inside < 0.0) & (x > 0.03)] *= 0.78

    def _vest(self, s: Samples) -> Array:
        x, y, z = s.canon_m.T
        rgb = self._base(s, self._person.vest or (0, 0, 0))
        bands = (np.abs(z - 1.045) < 0.025) | (np.abs(z - 1.185) < 0.025)
        braces = (np.abs(np.abs(y) - 0.105) < 0.024) & (z > 1.185)
        silver = bands | braces
        grain = 1.0 + 0.03 * self._noise(s.canon_m, 0.006)
        rgb = self._cloth(s, rgb, 0.07, 0.012)
        shine = _SILVER * (grain * (1.0 + 0.06 * self._noise.layered(s.canon_m, 0.10)))[:, None]
        rgb = np.where(silver[:, None], shine, rgb)
        rim = (np.abs(np.abs(z - 1.045) - 0.025) < 0.002) | (
            np.abs(np.abs(z - 1.185) - 0.025) < 0.002
        )
        rgb[rim] *= 0.82
        rgb[(x > 0.05) & (np.abs(y) < 0.0035)] = (92, 92, 90)
        rgb[(x > 0.05) & (np.abs(np.abs(y) - 0.013) < 0.0015)] *= 0.82
        return rgb

    def _trousers(self, s: Samples) -> Array:
        person = self._person
        x, y, z = s.canon_m.T
        rgb = self._base(s, person.trousers)
        side = np.abs(y) - 0.114
        if person.denim:
            fade = 0.22 * smoothstep(x, 0.02, 0.09) * smoothstep(np.abs(z - 0.72), 0.24, 0.05)
            rgb = rgb * (1.0 + fade)[:, None] + 26.0 * fade[:, None]
            rgb *= (1.0 + 0.05 * self._noise(s.canon_m, (0.004, 0.004, 0.02)))[:, None]
        rgb[(np.abs(x + 0.005) < 0.0022) & (side > 0.03)] *= 0.70
        rgb[(np.abs(y) < 0.002) & (z > 0.86)] *= 0.6
        # Pockets: slanted at the front, patches behind, cargo pockets at the thighs.
        slant = np.abs((z - 0.985) + 1.4 * (np.abs(y) - 0.115))
        rgb[(slant < 0.0035) & (x > 0.0) & (z < 1.03) & (z > 0.90)] *= 0.62
        back = np.maximum(np.abs(np.abs(y) - 0.085) - 0.05, np.abs(z - 0.935) - 0.055)
        rgb[(np.abs(back) < 0.002) & (x < -0.02)] *= 0.68
        if not person.denim:
            cargo = np.maximum(np.abs(x - 0.0) - 0.065, np.abs(z - 0.70) - 0.075)
            outside = side > 0.035
            rgb[(np.abs(cargo) < 0.0025) & outside] *= 0.66
            rgb[(cargo < 0.0) & outside] *= 0.96
            rgb[(np.abs(z - 0.74) < 0.002) & (cargo < 0.0) & outside] *= 0.7
        rgb[z < 0.065] *= 0.88
        rgb = self._cloth(s, rgb, 0.12)
        if person.reflective_legs:
            for height in (0.40, 0.30):
                rgb[np.abs(z - height) < 0.022] = _SILVER * 0.95
        return rgb

    def _glove(self, s: Samples) -> Array:
        rgb = self._base(s, self._person.gloves or (60, 60, 60))
        rgb *= (1.0 + 0.05 * self._noise.layered(s.canon_m, 0.02))[:, None]
        cuff = s.weights[:, [6, 9]].max(axis=1) < 0.6
        rgb[cuff] *= 0.75
        return rgb

    def _shoe(self, s: Samples) -> Array:
        rgb = self._base(s, self._person.shoes)
        x, y, z = s.canon_m.T
        rgb *= (1.0 + 0.05 * self._noise.layered(s.canon_m, 0.03))[:, None]
        rgb[x > 0.155] *= 0.80
        laced = (x > 0.055) & (x < 0.145) & (np.abs(np.abs(y) - 0.125) < 0.022) & (z > 0.07)
        rgb[laced & (np.mod(x, 0.018) < 0.007)] = (150, 146, 138)
        rgb[np.abs(z - 0.034) < 0.003] *= 0.7
        return rgb

    def _cap(self, s: Samples) -> Array:
        x, y, z = s.canon_m.T
        rgb = self._base(s, self._person.headwear[1])
        seam = np.abs(np.mod(np.arctan2(y, x) / (np.pi / 3.0) + 0.5, 1.0) - 0.5) < 0.015
        rgb[seam] *= 0.78
        badge = (x > 0.05) & (np.abs(y) < 0.028) & (np.abs(z - 0.045) < 0.016)
        rgb[badge] = 0.35 * rgb[badge] + 0.65 * np.array([225.0, 222.0, 212.0])
        rgb *= (1.0 + 0.03 * self._noise(s.canon_m, 0.004))[:, None]
        return rgb

    def _helmet(self, s: Samples) -> Array:
        x, y, z = s.canon_m.T
        rgb = self._base(s, self._person.headwear[1])
        ridge = np.abs(np.abs(y) - 0.026) < 0.003
        rgb[ridge & (z > 0.03)] *= 0.88
        logo = (x > 0.05) & (np.abs(y) < 0.022) & (np.abs(z - 0.05) < 0.013)
        rgb[logo] *= 0.55
        return rgb * (1.0 + 0.03 * np.clip(s.normals[:, 2:], -1, 1))


def _flat(s: Samples, colour: tuple[int, int, int]) -> Array:
    return np.tile(np.array(colour, dtype=np.float64), (len(s.canon_m), 1))
