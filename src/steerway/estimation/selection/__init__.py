"""Profiles from logs: `tune` in a minute with intervals, `select_profile` in a second."""
