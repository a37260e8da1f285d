"""Settings for every test."""

from __future__ import annotations

import os

from hypothesis import settings

# A busy machine must not fail a property for being slow; CI draws the same examples every time.
settings.register_profile("awarenav", deadline=None, derandomize=bool(os.environ.get("CI")))
settings.load_profile("awarenav")
