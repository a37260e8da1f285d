"""The crossings as a test-suite: ``pytest --pyargs sim_tests --awarenav-planner MODULE:CLASS``."""
