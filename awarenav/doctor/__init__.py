"""Findings about an installation and a camera: ``awarenav doctor``."""
