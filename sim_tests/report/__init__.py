"""The page that a run is judged by: one self-contained HTML file."""
