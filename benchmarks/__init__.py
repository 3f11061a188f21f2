"""What this costs, against what else one could use, on one machine in one run.

One file a subject, each with `run()` that yields results; `support` holds what they share.
"""
