"""Closed-loop crossings of a mobile robot and people in PyBullet."""
