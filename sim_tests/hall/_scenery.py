"""What the camera sees of a warehouse: racks with goods, props, hall and floor paint, in chunks."""

from __future__ import annotations

from functools import lru_cache

from .._errors import SimError
from ._layout import WarehouseLayout
from ._scenery_chunk import Colour, SceneryChunk
from ._scenery_hall import ceiling_chunks, floor_chunks, wall_chunks
from ._scenery_paint import paint_chunks
from ._scenery_props import prop_chunk
from ._scenery_racks import rack_chunks
from ._textures import scenery_texture

__all__ = ["Colour", "SceneryChunk", "scenery", "scenery_texture"]


@lru_cache(maxsize=8)  # many episodes play in the same hall
def scenery(layout: WarehouseLayout, variant: int = 0) -> tuple[SceneryChunk, ...]:
    """The pieces that a hall is drawn from; the same arguments give the same bytes.

    What usually hides other things comes first: a renderer with a depth buffer then shades fewer
    pixels twice.

    Args:
        layout: what stands where.
        variant: chooses goods, prints, tones and what hangs on the walls; a whole number ≥ 0.

    Raises:
        SimError: for a variant that is none.
    """
    if isinstance(variant, bool) or not isinstance(variant, int) or variant < 0:
        raise SimError(f"variant must be a whole number of at least 0, got {variant!r}")
    return (
        *(
            chunk
            for number, rack in enumerate(layout.racks)
            for chunk in rack_chunks(rack, number, variant)
        ),
        *(prop_chunk(prop, number, variant) for number, prop in enumerate(layout.props)),
        *wall_chunks(layout, variant),
        *paint_chunks(layout, variant),
        *floor_chunks(layout, variant),
        *ceiling_chunks(layout),
    )
