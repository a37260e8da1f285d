"""Scenarios on the command line, and their people's attention measured: ``awarenav scenario``."""
