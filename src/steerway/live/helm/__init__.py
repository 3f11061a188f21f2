"""The helm page: what the boat does, in a browser aboard, and a hand on the autopilot.

The page runs in a process of its own (`server`): drawing it costs milliseconds of Python, which in the service's
process, whatever the thread, would be milliseconds of the boat's rhythm. The service tells it what to show five times a
second over a pipe, and obeys what comes back (`bridge`).
"""
