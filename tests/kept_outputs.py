"""Outputs of a service, kept and compared."""

import asyncio
import contextlib
import json
from contextlib import asynccontextmanager
from types import SimpleNamespace

import numpy as np

from steerway.live.testing import Context, Navigator, Row, Service, addresses
from tests.ports import under_way


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


@asynccontextmanager
async def serving(listen, say=(), sources=(), kept=None, **settings):
    """A running live service with these addresses of inputs and outputs; gives its rows."""
    kept = kept or Kept()
    found, _ = addresses.sources(listen)
    inputs = [addresses.opened(each, len(found)) for each in found]
    pairs = [addresses.output(each, Context(inputs=inputs)) for each in say]
    service = Service(Navigator("small-usv", sources=sources), [kept, *(output for output, _ in pairs)], **settings)
    async with under_way(service.run(inputs, [link for _, link in pairs if link])):
        yield kept


async def stopped_after(service, receives):
    """Run a service until `receives(deliver)` has delivered all that its link gets, and stop it as Ctrl-C does."""

    async def link(deliver):
        await receives(deliver)
        running.cancel()

    running = asyncio.create_task(service.run([SimpleNamespace(run=link)]))
    with contextlib.suppress(asyncio.CancelledError):
        await running


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
