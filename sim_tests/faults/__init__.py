"""What goes wrong between camera, odometry and tracker, as data, and its injection."""
