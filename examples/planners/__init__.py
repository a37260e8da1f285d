"""Planners that others wrote, driving the crossings of this package in PyBullet."""
