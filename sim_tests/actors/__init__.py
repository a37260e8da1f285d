"""Robots and people of a crossing: their bodies and their behaviour."""
