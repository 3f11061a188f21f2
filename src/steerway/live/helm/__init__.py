"""The helm page: the state of the boat in a browser, with start and stop of the autopilot.

The page runs in a process of its own (`server`). Drawing it takes milliseconds of Python, which would delay the ticks
in any thread of the service's process. The service sends the page a view five times a second over a pipe, and carries
out the page's requests (`page_process`).
"""
