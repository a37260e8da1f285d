"""How many of the looks that answer a request the robot measures, and how soon."""
