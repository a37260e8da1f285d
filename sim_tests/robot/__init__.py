"""The robot: its physics, its looks, and the reference planner that drives it."""
