"""Places that tests read from."""

from __future__ import annotations

from pathlib import Path

#: The checkout.
ROOT = Path(__file__).resolve().parents[1]
#: Networks, images and recordings beside the checkout, which need not be there.
SHARED = ROOT.parent / "shared"
