"""Who was followed through a file of estimates, drawn: paths in odom and awareness over time."""
