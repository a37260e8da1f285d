"""Policies tuned for the least time lost at a given risk: ``awarenav tune``."""

from ._results import run_tune
