"""A sensor that knows the truth about everybody who is not hidden by a rack."""

from __future__ import annotations

from ._sensor import MapView
from ._truth import Truth


class Oracle(Truth, name="oracle"):
    """The truth about everybody whom no rack and no wall hides, in all directions."""

    @property
    def view(self) -> MapView:
        """Places that no high box hides."""
        return MapView.of(self.stage.warehouse)
