"""Searches that can be killed and resumed, by several processes: what tuning and falsifying share."""
