from __future__ import annotations

from hypothesis import HealthCheck, settings

# A busy machine must not turn a true property into a failure.
settings.register_profile(
    "nav_adapter", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("nav_adapter")
