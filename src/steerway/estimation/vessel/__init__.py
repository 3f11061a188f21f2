"""What a vessel and its receiver are, as the filters take it."""
