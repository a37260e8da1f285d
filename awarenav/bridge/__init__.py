"""A robot's camera on ROS 2 topics in, constraints for Nav2 out: ``awarenav bridge``."""
