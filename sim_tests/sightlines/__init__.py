"""Lines of sight held against the surfaces that pictures show, without drawing a picture."""
