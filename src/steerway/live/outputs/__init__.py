"""Outputs: the form of what is sent, and when; the table of forms is `formats`."""
