"""The helm page: the state of the boat in a browser, with start and stop of the autopilot.

The page runs in a process of its own (`server`): drawing it takes milliseconds of Python, which in any thread of the
service's process would delay the ticks. The service sends the page a view five times a second over a pipe, and carries
out the requests that come back (`page_process`).
"""
