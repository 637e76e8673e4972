"""What a page sees of a run, and what it may ask of it."""
