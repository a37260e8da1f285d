"""Crossings as a pytest suite: ``pytest --pyargs sim_tests --awarenav-planner MODULE:CLASS``."""
