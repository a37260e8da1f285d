"""Head: skin of face and neck, eyeballs, hair."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.sparse import csr_matrix

from ._body import Body
from ._cloth import cut, drape, signed_distance, smooth_normals
from ._person import Person
from ._piece import Array, Piece, smoothstep
from ._places import Places

#: Hairline on the average head in the sagittal plane (x, z): forehead, temple, sideburn, round the
#: ear, nape, and closed far behind and above.
_HAIRLINE: Final = np.array(
    [
        (0.142, 1.800), (0.122, 1.790), (0.104, 1.772), (0.094, 1.748), (0.086, 1.735),
        (0.080, 1.700), (0.068, 1.690), (0.060, 1.722), (0.050, 1.742), (0.024, 1.744),
        (0.008, 1.716), (0.002, 1.680), (-0.012, 1.650), (-0.03, 1.636), (-0.20, 1.630),
        (-0.20, 2.00), (0.22, 2.00), (0.22, 1.83),
    ]
)  # fmt: skip
#: Thickness of hair on top, at the sides and back.
_THICK_M: Final = {
    "short": (0.022, 0.009),
    "crop": (0.006, 0.005),
    "bob": (0.020, 0.014),
    "bun": (0.012, 0.009),
    "ponytail": (0.014, 0.010),
    "bald": (0.0, 0.0),
}


class Head:
    """Everything above the collar except hats."""

    def __init__(
        self,
        body: Body,
        person: Person,
        places: Places,
        neighbours: csr_matrix,
        neckline: Array,
        hat_line: Array | None,
    ) -> None:
        self._body, self._person, self._at = body, person, places
        self._neighbours = neighbours
        self._neckline = neckline
        self._hat_line = hat_line
        x, _, z = places.canon_m.T
        self._hair_field = signed_distance(_HAIRLINE, np.column_stack([x, z]))
        self._hair_field = np.where(z > 1.60, self._hair_field, -1.0)
        self._normals = smooth_normals(body.vertices_m, body.triangles, neighbours, 5)
        self.hair_m = self._grow()

    def pieces(self) -> list[Piece]:
        """Return the pieces of face and neck, eyes and hair."""
        return [self._face(), *self._eyes(), *self._hair()]

    def _grow(self) -> Array:
        """Return the surface of the hair over every vertex; the skin where there is no hair."""
        top, side = _THICK_M[self._person.hair]
        if top == 0.0:
            return self._body.vertices_m
        z = self._at.canon_m[:, 2]
        high = smoothstep(z, 1.72, 1.80)
        thick = side + (top - side) * high
        thick = thick * smoothstep(self._hair_field, -0.002, 0.022 if top > 0.008 else 0.012)
        if self._person.headwear[0] != "none":
            thick = np.minimum(thick, 0.009)
        thick = np.where(self._hair_field > 0.0, thick, 0.0) - 0.0012
        rounds = 10 if top > 0.008 else 3
        return drape(self._body.vertices_m, self._normals, thick, self._neighbours, rounds, 0.4)

    def _face(self) -> Piece:
        """Return the skin down to below the collar, without parts under thick hair."""
        z = self._at.canon_m[:, 2]
        neck = np.minimum(0.080 - self._neckline, np.where(self._at.arm > 0.5, -1.0, z - 1.40))
        field = neck
        if self._person.hair != "bald":
            field = np.minimum(field, 0.028 - self._hair_field)
        if self._hat_line is not None:
            field = np.minimum(field, 0.02 - self._hat_line)
        part = cut(self._body.triangles, field)
        # Skin under cloth lies deeper, so that coarse levels of detail keep them apart.
        sunk = 0.014 * smoothstep(self._neckline, 0.008, 0.035)
        lift = self._beard() - np.where(self._at.arm > 0.5, 0.0, sunk)
        return Piece(
            "face",
            part(self._body.vertices_m + self._normals * lift[:, None]),
            part.triangles,
            part(self._body.weights),
            part(self._at.canon_m),
            (2150, 520, 160),
        )

    def _beard(self) -> Array:
        """Return the thickness of the beard over the skin."""
        return 0.007 * max(0.0, self._person.beard - 0.4) / 0.6 * beard_mask(self._at.canon_m)

    def _eyes(self) -> list[Piece]:
        made = []
        for triangles in self._body.eyes:
            rows, index = np.unique(triangles, return_inverse=True)
            made.append(
                Piece(
                    "eye",
                    self._body.vertices_m[rows],
                    index.reshape(-1, 3),
                    self._body.weights[rows],
                    self._at.canon_m[rows] - self._at.canon_m[rows].mean(axis=0),
                    (90, 40, 12),
                )
            )
        return made

    def _hair(self) -> list[Piece]:
        if self._person.hair == "bald":
            return []
        field = self._hair_field
        if self._hat_line is not None:
            field = np.minimum(field, 0.015 - self._hat_line)
        part = cut(self._body.triangles, field)
        weights = part(self._body.weights)
        weights[:] = 0.0
        weights[:, :2] = 1.0
        budget = (600, 180, 70) if self._hat_line is None else (260, 90, 30)
        made = [
            Piece(
                "hair", part(self.hair_m), part.triangles, weights, part(self._at.canon_m), budget
            )
        ]
        if self._person.hair == "bun":
            made.append(self._blob((-0.080, 0.0, 1.770), (0.038, 0.045, 0.040)))
        elif self._person.hair == "ponytail":
            made.append(self._tail())
        elif self._person.hair == "bob":
            made.append(self._curtain())
        return made

    def _fit(self, canon: Array) -> Array:
        """Return a place of the average head on this head, scaled with its size."""
        own = self._body.vertices_m[self._scalp_rows()]
        average = self._at.canon_m[self._scalp_rows()]
        scale = np.ptp(own, axis=0) / np.ptp(average, axis=0)
        fitted: Array = (canon - average.mean(axis=0)) * scale + own.mean(axis=0)
        return fitted

    def _scalp_rows(self) -> Array:
        rows: Array = np.flatnonzero(self._at.canon_m[:, 2] > 1.70)
        return rows

    def _rigid(self, canon: Array, triangles: Array, budget: tuple[int, int, int]) -> Piece:
        weights = np.zeros((len(canon), self._body.weights.shape[1]))
        weights[:, :2] = 1.0
        return Piece("hair", self._fit(canon), triangles, weights, canon, budget)

    def _blob(self, center: tuple[float, ...], axes: tuple[float, ...]) -> Piece:
        points, triangles = sphere(14, 20)
        return self._rigid(points * axes + center, triangles, (120, 50, 16))

    def _tail(self) -> Piece:
        """Return a tail from the back of the head down to the nape."""
        share = np.linspace(0.0, 1.0, 16)
        x = -0.047 - 0.062 * np.sin(share * 2.3) + 0.026 * share
        z = 1.758 - 0.205 * share**1.25
        radius = 0.014 + 0.020 * np.sin(np.clip(share * 1.25, 0, 1) * np.pi * 0.75)
        radius[-1], radius[0] = 0.003, 0.010
        angle = np.linspace(0.0, 2.0 * np.pi, 13)
        rings = np.stack(
            [
                x[:, None] + radius[:, None] * np.cos(angle) * 0.9,
                radius[:, None] * np.sin(angle) * 1.15,
                z[:, None] + 0.35 * radius[:, None] * np.cos(angle),
            ],
            axis=-1,
        )
        points, triangles = loft(rings)
        return self._rigid(points, triangles, (180, 70, 24))

    def _curtain(self) -> Piece:
        """Return hair at the sides and the back down to the jaw."""
        angle = np.radians(np.linspace(58.0, 302.0, 44))
        share = np.linspace(0.0, 1.0, 14)[:, None]
        back = 0.5 - 0.5 * np.cos(angle)
        z = 1.795 - share * (0.152 + 0.022 * back)
        # From the scalp over the ears and back to the neck at the ends.
        swell = (
            0.70 + 0.37 * np.sin(np.clip(share * 1.25, 0.0, 1.0) * 0.5 * np.pi) - 0.09 * share**4
        )
        edge = smoothstep(np.minimum(angle - angle[0], angle[-1] - angle), 0.0, 0.35)
        swell = swell * (0.93 + 0.07 * edge)
        outer = np.stack(
            [0.022 + 0.112 * np.cos(angle) * swell, 0.0965 * np.sin(angle) * swell, z],
            axis=-1,
        )
        inner = outer[::-1].copy()
        thick = 1.0 - 0.11 * edge[None, :, None]
        inner[..., :2] = (inner[..., :2] - [0.022, 0.0]) * thick + [0.022, 0.0]
        points, triangles = loft(np.concatenate([outer, inner]))
        return self._rigid(points, triangles, (380, 140, 44))


def beard_mask(canon: Array) -> Array:
    """Return 1 where a full beard grows on the average face, 0 elsewhere."""
    x, y, z = canon.T
    side = np.abs(y)
    # The cheek line runs from the sideburn down to the corner of the mouth.
    cheek = smoothstep(z + 0.50 * (np.maximum(x, 0.068) - 0.068), 1.706, 1.694)
    jaw = smoothstep(x, 0.048, 0.060) * smoothstep(z, 1.582, 1.606) * cheek
    clear = smoothstep(np.hypot(side / 0.031, (z - 1.690) / 0.030), 0.95, 1.15)
    upper = smoothstep(side, 0.036, 0.028) * smoothstep(x, 0.10, 0.11)
    upper *= smoothstep(z, 1.6745, 1.669) * smoothstep(z, 1.650, 1.654)
    lips = smoothstep(np.hypot(y / 0.029, (z - 1.648) / 0.0125), 0.9, 1.1)
    grown: Array = np.clip(np.maximum(jaw * clear, upper), 0.0, 1.0) * lips
    return grown


def sphere(rings: int, sides: int) -> tuple[Array, Array]:
    """Return a unit sphere as a lofted grid with its poles on z."""
    polar = np.linspace(1e-3, np.pi - 1e-3, rings)[:, None]
    around = np.linspace(0.0, 2.0 * np.pi, sides + 1)[None]
    grid = np.stack(
        [
            np.sin(polar) * np.cos(around),
            np.sin(polar) * np.sin(around),
            np.cos(polar) + 0 * around,
        ],
        axis=-1,
    )
    return loft(grid)


def loft(rings: Array) -> tuple[Array, Array]:
    """Return triangles between rings of points that run downwards, counter-clockwise from above."""
    count, sides = rings.shape[:2]
    i, j = np.meshgrid(np.arange(count - 1), np.arange(sides - 1), indexing="ij")
    a = (i * sides + j).ravel()
    triangles = np.concatenate(
        [np.stack([a, a + sides, a + sides + 1], 1), np.stack([a, a + sides + 1, a + 1], 1)]
    )
    return rings.reshape(-1, 3), triangles
