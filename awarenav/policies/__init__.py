"""Radius, human speed and speed limit of policies: ``awarenav policy``."""
