"""Looks that answer a request: how many the robot measures, and how soon."""
