"""The scenarios: what there is, what they look like and whether they bring people together."""
