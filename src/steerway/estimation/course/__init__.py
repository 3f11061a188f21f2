"""Speed over ground, course over ground and course rate from positions."""
