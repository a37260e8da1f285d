"""The demonstration: ``awarenav demo``."""
