"""How many pictures a second ``awarenav bridge`` works through, how late, and at what cost."""
