"""Third-party planners in crossings of this package in PyBullet."""
