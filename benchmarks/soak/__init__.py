"""`steerway live` for minutes on end with every output open, beside an event loop that does nothing.

`python -m benchmarks.soak [--minutes M]`. A receiver on a pseudo-terminal tells RMC, GGA and UBX five times a second at
the pace of 38400 baud, some of it damaged; the command runs as a user starts it, fifty ticks a second.
"""
