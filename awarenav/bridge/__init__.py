"""From a ROS 2 camera to obstacles and a speed limit for Nav2: ``awarenav bridge``."""
