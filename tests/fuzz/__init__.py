"""Fuzzing, for long by `make fuzz`: mutations of generated and recorded inputs go to everything that reads what others
wrote (`tests/test_fuzz.py`). Findings become tests there."""
