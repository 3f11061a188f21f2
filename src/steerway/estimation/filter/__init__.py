"""The filter, each equation once."""
