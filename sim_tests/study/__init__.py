"""Many crossings: runs, metrics, the report, and the test suite for planners."""
