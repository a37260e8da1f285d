"""The demonstration and the speed benchmark: ``awarenav demo`` and ``awarenav bench``."""
