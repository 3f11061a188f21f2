"""`steerway live` for several minutes with every output open, beside an event loop that does nothing.

`python -m benchmarks.soak [--minutes M]`. A receiver on a pseudo-terminal sends RMC, GGA and UBX five times a second at
the pace of 38400 baud, some of them damaged. The command runs as a user starts it, with fifty ticks a second.
"""
