"""Situations searched in which a policy does worst: ``awarenav falsify``."""
