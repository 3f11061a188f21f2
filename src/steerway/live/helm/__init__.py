"""The helm page: the state of the boat in a browser, with start and stop of the autopilot.

The page runs in a process of its own (`server`): drawing it takes milliseconds of Python, which in the service's
process would delay its ticks, whatever the thread. The service sends it a view five times a second over a pipe and
carries out what comes back (`page_process`).
"""
