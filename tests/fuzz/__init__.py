"""Fuzzing: mutations of generated and recorded inputs go to every reader of foreign data. `tests/test_fuzz.py` runs it
briefly, `make fuzz` for long. Findings become tests there."""
