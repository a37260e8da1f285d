"""Settings for the tests of nav_adapter."""

from __future__ import annotations

from hypothesis import HealthCheck, settings

# A busy computer must not fail a property for being slow.
settings.register_profile(
    "nav_adapter", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("nav_adapter")
