"""Searches that may be killed and shared by processes: for tuning and falsifying."""
