"""Estimates of people in pictures from anywhere, and how good they are against the truth."""
