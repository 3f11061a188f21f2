"""What a service puts out, kept and compared."""

import json

import numpy as np

from steerway.live.testing import Row


class Kept:
    """An output that keeps its rows."""

    def __init__(self):
        self.fixes, self.ticks = [], []

    def fix(self, row):
        self.fixes.append(row)

    def tick(self, row, leg=None, order=None):
        self.ticks.append(row)

    def close(self):
        pass


def first_of_each(fixes):
    """The fixes without those that repeat one: live, no row is output twice."""
    places = np.column_stack([fixes.time, fixes.latitude, fixes.longitude])[fixes.has_position]
    return np.sort(np.unique(places, axis=0, return_index=True)[1])


def assert_equal(rows, motion):
    assert len(rows) == len(motion)
    columns = np.array(rows, dtype=float).reshape(-1, len(Row._fields)).T
    for name, column in zip(Row._fields, columns, strict=True):
        np.testing.assert_allclose(column, getattr(motion, name), rtol=1e-9, atol=1e-10, err_msg=name)


class RecordingSink:
    """`messages`: everything that was sent."""

    def __init__(self):
        self.messages = []

    def send(self, message):
        self.messages.append(message)

    def close(self):
        pass

    def lines(self):
        return [json.loads(message) for message in self.messages]
