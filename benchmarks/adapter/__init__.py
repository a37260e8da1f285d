"""What the adapter and its exporters cost, against painting the same costmap with shapely."""
