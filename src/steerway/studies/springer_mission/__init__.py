"""P4: Springer's mission."""
