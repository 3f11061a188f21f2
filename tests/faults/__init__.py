"""The fault matrix: what the service says when something is wrong with what it hears.

`python -m tests.faults` measures every fault and writes the table of docs/live.md anew.
"""
