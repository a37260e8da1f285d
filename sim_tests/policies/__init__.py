"""Policies shown: radius, human speed and speed limit over awareness and distance."""
