"""Many crossings: in parallel, under faults, resumable, the same on any number of workers."""
