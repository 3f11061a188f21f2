"""The commands, thin: each does one job and leaves the work to the library."""
