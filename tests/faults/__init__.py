"""The fault matrix: the output of the service, of commands and of the autopilot when something is wrong.

`python -m tests.faults` measures every fault and rewrites the tables of the docs.
"""
