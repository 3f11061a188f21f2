"""What cases share: columns of rows, thinned, and input that needs no chance but a seed."""

import numpy as np


def columns(names: str, rows, every: int = 1) -> dict[str, np.ndarray]:
    """Columns named by words from rows of numbers; every so many rows, counted from the last one."""
    table = np.array([np.hstack([np.ravel(each) for each in row]) for row in rows], dtype=float)
    names = names.split()
    if len(names) != table.shape[1]:
        raise ValueError(f"{len(names)} names for {table.shape[1]} columns")
    return dict(zip(names, table[::-1][::every][::-1].T, strict=True))
