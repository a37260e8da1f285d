"""Tuning of policies: time lost against the separation margin, without contacts."""
