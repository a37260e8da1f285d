"""Searches that can be killed, resumed and shared by processes: tuning and falsification."""
