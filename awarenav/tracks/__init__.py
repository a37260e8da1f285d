"""Tracks of the people in a file of estimates, drawn and tabulated: ``awarenav tracks``."""
