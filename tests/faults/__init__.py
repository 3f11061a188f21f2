"""The fault matrix: what the service reports when something is wrong with its inputs.

`python -m tests.faults` measures every fault and writes the table of docs/service.md anew.
"""
