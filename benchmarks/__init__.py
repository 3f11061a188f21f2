"""Processor time and memory of Steerway and of alternatives, measured on one machine in one run.

One file per subject, each with `run()`, which yields results; `support` contains shared code.
"""
