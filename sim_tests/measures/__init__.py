"""What is measured in crossings, and what can be said from many of them."""
