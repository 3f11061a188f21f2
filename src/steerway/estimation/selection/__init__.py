"""Profiles from logs: `tuned` in a minute with all that can be told, `choice` in a second."""
