"""Measurement updates: positions, aids, and the likelihood by which outliers are refused."""
