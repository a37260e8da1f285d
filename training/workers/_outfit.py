"""Clothes of a worker, cut and labelled: shirt, collar, vest, trousers, gloves, bare arms."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from scipy.sparse import csr_matrix

from ._body import Body
from ._cloth import cut, open_edges, smooth_normals
from ._drape import Drapes
from ._person import Person
from ._piece import Array, Piece, smoothstep
from ._places import Places


class Top(NamedTuple):
    """Cut lines of an upper garment on the average body, and its slack."""

    hem_z_m: float
    sleeve_m: float
    collar_z_m: float
    collar_slope: float
    slack_m: float


TOPS: Final = {
    "tshirt": Top(0.905, 0.20, 1.555, 0.30, 0.010),
    "polo": Top(0.915, 0.23, 1.572, 0.42, 0.010),
    "shirt": Top(0.905, 0.525, 1.580, 0.42, 0.011),
    "checked": Top(0.905, 0.525, 1.580, 0.42, 0.011),
    "hoodie": Top(0.880, 0.535, 1.582, 0.42, 0.018),
    "jacket": Top(0.870, 0.540, 1.585, 0.42, 0.019),
    "overalls": Top(1.010, 0.525, 1.568, 0.30, 0.010),
}
#: Collars: height, outward lean, length of the fold, opening at the throat.
_COLLARS: Final = {
    "polo": (0.026, 0.006, 0.030, 16.0),
    "shirt": (0.028, 0.006, 0.032, 14.0),
    "checked": (0.028, 0.006, 0.032, 14.0),
    "hoodie": (0.030, 0.016, 0.040, 10.0),
    "jacket": (0.036, 0.008, 0.046, 8.0),
}
_OVERLAP_M: Final = 0.03


class Outfit:
    """Clothes of one worker, cut from draped cloth.

    Paint and cut lines are laid out on the same clothes of the average body, so that bands and hems
    run level.
    """

    def __init__(
        self, body: Body, average: Body, person: Person, places: Places, neighbours: csr_matrix
    ) -> None:
        self._body, self._person, self._at = body, person, places
        self._top = top = TOPS[person.top]
        self.neckline = places.collar(top.collar_z_m, top.collar_slope)
        own, mean = (
            Drapes(
                who,
                places,
                neighbours,
                slack_m=top.slack_m,
                sleeve_m=top.sleeve_m,
                neckline=self.neckline,
            )
            for who in (body, average)
        )
        self._own, self._mean = own, mean
        self._on_shirt = Places(average, mean.shirt_m)
        self._on_vest = Places(average, mean.vest_m)
        self._on_trousers = Places(average, mean.trousers_m)
        self._normals = smooth_normals(body.vertices_m, body.triangles, neighbours, 3)

    def pieces(self) -> list[Piece]:
        """Return all pieces below the chin except the shoes."""
        top = self._shirt()
        made = [top, self._trousers(), self._socks(), *self._hands()]
        if self._person.top in _COLLARS:
            made.append(self._collar())
        if self._person.vest is not None:
            made.append(self._vest())
        return made

    def _piece(
        self,
        label: str,
        field: Array,
        at_m: Array,
        canon_m: Array,
        budget: tuple[int, int, int],
        lip_m: float = 0.0,
    ) -> Piece:
        part = cut(self._body.triangles, field)
        return Piece(
            label=label,
            vertices_m=part(at_m),
            triangles=part.triangles,
            weights=part(self._body.weights),
            canon_m=part(canon_m),
            budget=budget,
            lip_m=lip_m,
        )

    def _whole_shirt(self) -> Array:
        return np.minimum.reduce(
            [
                self._on_shirt.above(self._top.hem_z_m),
                self._at.sleeve(self._top.sleeve_m),
                self.neckline,
            ]
        )

    def _vest_field(self) -> Array:
        return np.minimum.reduce(
            [
                self._on_vest.above(0.925),
                self._at.armhole(),
                self._at.collar(1.545),
                self._on_vest.neckline_v(1.33),
            ]
        )

    def _shirt(self) -> Piece:
        field, covered = self._whole_shirt(), self._tucked()
        if self._person.vest is not None:
            field = np.minimum(field, _OVERLAP_M - self._vest_field())
            covered = np.maximum(covered, smoothstep(self._vest_field(), 0.004, 0.020))
        at_m = self._own.shirt_m - 0.008 * covered[:, None] * self._normals
        budget = (1400, 400, 140) if self._person.vest is None else (1000, 300, 100)
        return self._piece("top", field, at_m, self._mean.shirt_m, budget, 0.008)

    def _tucked(self) -> Array:
        """Return 1 where the shirt is inside the trousers, 0 elsewhere."""
        inside = smoothstep(self._on_shirt.below(1.040), 0.0, 0.020)
        return inside if self._top.hem_z_m > 1.0 else np.zeros_like(inside)

    def _vest(self) -> Piece:
        field, budget = self._vest_field(), (850, 260, 100)
        return self._piece("vest", field, self._own.vest_m, self._mean.vest_m, budget, 0.008)

    def _trousers(self) -> Piece:
        waist = 1.040 if self._top.hem_z_m > 1.0 else self._top.hem_z_m + 0.06
        field = np.minimum(self._on_trousers.below(waist), self._at.foot())
        budget = (1100, 310, 110)
        # Trousers lie closer under a shirt that hangs over them.
        over = self._on_trousers.canon_m[:, 2] - self._top.hem_z_m
        covered = smoothstep(over, 0.0, 0.030) * (1.0 - self._tucked().max())
        at_m = self._own.trousers_m - 0.010 * covered[:, None] * self._normals
        piece = self._piece("trousers", field, at_m, self._mean.trousers_m, budget, 0.007)
        # Hems follow the shank; the foot turns under them.
        piece.weights[:, [12, 15]] = 0.0
        return piece

    def _collar(self) -> Piece:
        """Return a strip that stands up from the shirt's neckline and folds over."""
        height, lean, fold, gap_deg = _COLLARS[self._person.top]
        part = cut(self._body.triangles, self._whole_shirt())
        own, canon = part(self._own.shirt_m), part(self._mean.shirt_m)
        edges = open_edges(part.triangles)
        arm = part(self._at.arm)
        edges = edges[((canon[edges, 2] > 1.45) & (arm[edges] < 0.3)).all(axis=1)]
        rows, index = np.unique(edges, return_inverse=True)
        rim = own[rows]
        center = rim.mean(axis=0)
        out = (rim - center) * [1.0, 1.0, 0.0]
        angle = np.degrees(np.arctan2(np.abs(out[:, 1]), out[:, 0]))
        out /= np.linalg.norm(out, axis=1, keepdims=True)
        up = np.array([0.22, 0.0, 0.975])
        full = smoothstep(angle, 0.4 * gap_deg, gap_deg)[:, None]
        back = smoothstep(angle, 90.0, 160.0)[:, None] if self._person.top == "hoodie" else 0.0
        rings = [
            rim - 0.006 * up,
            rim + full * height * up + 0.001 * out,
            rim + full * (1.08 * height * up + (lean + 0.020 * back) * out),
            rim
            + full
            * ((height - fold - 0.03 * back) * up + (1.6 * lean + 0.004 + 0.025 * back) * out),
            rim + full * ((height - fold) * up + 0.002 * out),
        ]
        count, levels = len(rows), len(rings)
        a, b = index.reshape(-1, 2).T
        strips = []
        for level in range(levels - 1):
            low, high = level * count, (level + 1) * count
            strips.append(np.stack([b + low, a + low, a + high], axis=1))
            strips.append(np.stack([b + low, a + high, b + high], axis=1))
        return Piece(
            "collar",
            np.concatenate(rings),
            np.concatenate(strips)[:, ::-1],
            np.tile(part(self._body.weights)[rows], (levels, 1)),
            np.tile(canon[rows], (levels, 1))
            + np.repeat(np.arange(levels), count)[:, None] * [0, 0, 0.01],
            (260, 90, 24),
        )

    def _socks(self) -> Piece:
        z = self._at.canon_m[:, 2]
        ankle = np.where(self._at.arm > 0.3, -1.0, np.minimum(0.20 - z, z - 0.05))
        return self._piece("sock", ankle, self._body.vertices_m, self._at.canon_m, (140, 60, 0))

    def _hands(self) -> list[Piece]:
        """Return the hands, bare or gloved, and the parts of the arms without a sleeve."""
        bare_m, canon = self._body.vertices_m, self._at.canon_m
        along = np.where(self._at.arm > 0.3, self._at.along_arm_m, -1.0)
        bare = along - (self._top.sleeve_m - _OVERLAP_M)
        budget = (1150, 300, 90) if self._top.sleeve_m < 0.3 else (900, 230, 64)
        if self._person.gloves is None:
            return [self._piece("skin", bare, bare_m, canon, budget)]
        glove_m = bare_m + 0.0025 * self._normals
        made = [self._piece("glove", along - 0.495, glove_m, canon, (900, 230, 64), 0.004)]
        if self._top.sleeve_m < 0.3:
            arm = np.minimum(bare, 0.53 - along)
            made.append(self._piece("skin", arm, bare_m, canon, (360, 120, 40)))
        return made
