"""Workers: bodies, gait and postures, what they look like, what a script has them do."""
