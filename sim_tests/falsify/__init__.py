"""Falsification: the people, within human limits, who come nearest to harm."""
