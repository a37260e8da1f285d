"""The networks in the box and those for a real robot: listed, verified, fetched."""
