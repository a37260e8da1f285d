"""Sets of rendered pictures with the truth about the people in them."""
