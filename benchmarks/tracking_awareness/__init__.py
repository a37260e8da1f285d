"""Awareness on simulated attention: how soon it is known, how soon it is given up, and how sure."""
