"""Policies searched for little time lost and little margin violated: ``awarenav tune``."""
