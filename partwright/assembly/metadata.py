"""Keys of a part's metadata that pictures and lists know."""

GUESSED = "guessed"  # of a part that the input does not show: why it is there
