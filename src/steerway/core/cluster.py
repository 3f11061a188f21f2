"""A Dask cluster to run work on."""

from typing import Any

from steerway.core.errors import InputError
from steerway.core.extras import missing

CONNECTING = 10.0
"""s to wait for a cluster's scheduler."""


def connected(address: str, option: str) -> Any:
    """A `distributed.Client` of a scheduler, to be closed by `with`.

    Raises InputError where Dask is not installed, naming the option that needs it, or no scheduler responds.
    """
    try:
        from dask import distributed
    except ImportError:
        raise missing(option, "distributed", "dask") from None
    client: Any = distributed.Client
    try:
        return client(address, timeout=CONNECTING, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(f"no Dask scheduler responds at {address!r}, expected host:port ({error})") from None
