"""The kernels of archives."""
