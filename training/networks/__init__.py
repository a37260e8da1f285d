"""Trains the networks that ship with ``perception``: see README.md in this folder."""
