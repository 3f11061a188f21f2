"""A hook for programs that want to announce the compilation of kernels."""

from collections.abc import Callable

announce: Callable[[], None] | None = None
"""Called once, before the first compilation of the process; never if all kernels are in the cache."""
