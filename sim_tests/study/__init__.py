"""Many crossings: runs, measures, the report, and the test suite for planners."""
