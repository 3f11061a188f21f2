"""Heading from compasses, a gyro and GNSS."""
