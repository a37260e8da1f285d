"""The scenery of a hall as the camera sees it: every mesh in chunks, with a texture's name."""

from __future__ import annotations

from functools import lru_cache

from ..errors import SimError
from ._layout import WarehouseLayout
from ._meshes import SceneryChunk
from ._scenery_hall import ceiling_chunks, floor_chunks, wall_chunks
from ._scenery_markings import marking_chunks
from ._scenery_props import prop_chunk
from ._scenery_racks import rack_chunks


@lru_cache(maxsize=8)  # many episodes use the same hall
def scenery(layout: WarehouseLayout, variant: int = 0) -> tuple[SceneryChunk, ...]:
    """Return the chunks that a hall is drawn from; the same arguments give the same bytes.

    Chunks that usually hide others come first, so a renderer with a depth buffer shades fewer
    pixels twice.

    Args:
        layout: the hall.
        variant: chooses goods, prints, tones and wall fixtures; a whole number ≥ 0.

    Raises:
        SimError: for a variant that is not a whole number ≥ 0.
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
        *marking_chunks(layout, variant),
        *floor_chunks(layout, variant),
        *ceiling_chunks(layout),
    )
