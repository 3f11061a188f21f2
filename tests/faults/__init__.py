"""The fault matrix: the service's output when something is wrong with its inputs.

`python -m tests.faults` measures every fault and rewrites the table of docs/service.md.
"""
