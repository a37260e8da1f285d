"""Ours, norfair, Stone Soup and a naive tracker side by side on the same simulated walkers."""
