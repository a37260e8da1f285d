"""Cost of the adapter and its exporters, against the same costmap painted with shapely."""
