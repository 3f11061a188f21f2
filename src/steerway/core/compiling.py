"""What happens when kernels begin to be compiled: nothing, unless a program sets `announce`."""

from collections.abc import Callable

announce: Callable[[], None] | None = None
"""Called once, before the first compilation of the process; not where everything is in the cache."""
