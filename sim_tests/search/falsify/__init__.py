"""The situations in which a policy does worst, found by optimisation: ``awarenav falsify``."""
