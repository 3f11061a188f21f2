"""A scenario's boat in real time, on the links of a real one."""
