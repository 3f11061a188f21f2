"""Replay of a recording: its inputs go through the navigator again, and its estimates have to be the same."""

import json
import math
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from steerway.core.errors import InputError
from steerway.core.records import Motion
from steerway.estimation.profiles.inferred import load_profile
from steerway.formats.mcap import INPUT, MAGIC, messages, require_mcap
from steerway.live.base.rows import InputRow, Row
from steerway.live.learning import RepeatedLearning
from steerway.live.navigator import Navigator
from steerway.live.recording import ESTIMATE, LEARNING, ORDER, SETTINGS
from steerway.live.service import RATE, Service

ANOTHER_PROCESSOR = 1e-9
"""Bound of `Replayed.largest` for a recording of another processor; x86-64 on aarch64: 5e-14 with a profile, 6e-12 with
an inferred one."""


class Replayed(NamedTuple):
    """What came of a replay. `recorded`, `repeated`: the rows at the fixes; `orders`: their number in the recording."""

    recorded: list[Row]
    repeated: list[Row]
    inputs: int
    orders: int

    @property
    def differing(self) -> int:
        """The number of rows that are not the same in every bit, or that only one of both has."""
        pairs = zip(self.recorded, self.repeated, strict=False)
        unequal = sum(np.array(one, float).tobytes() != np.array(other, float).tobytes() for one, other in pairs)
        return unequal + abs(len(self.recorded) - len(self.repeated))

    @property
    def largest(self) -> float:
        """The largest difference, in SI and of numbers above 1 as a part of them; inf where a row or number is missing.

        Another processor rounds sums and products in another order: see ANOTHER_PROCESSOR.
        """
        if len(self.recorded) != len(self.repeated):
            return math.inf
        one, other = np.array(self.recorded, float), np.array(self.repeated, float)
        if (np.isnan(one) != np.isnan(other)).any():
            return math.inf
        return float(np.nanmax(np.abs(one - other) / np.maximum(np.abs(one), 1.0), initial=0.0))

    def motion(self) -> Motion:
        """The repeated rows as a record."""
        columns = dict(zip(Row._fields, np.array(self.repeated, float).reshape(-1, len(Row._fields)).T, strict=True))
        return Motion(**(columns | {"status": columns["status"].astype(np.uint8)}))


class _Kept:
    """An output that keeps the rows of the fixes."""

    def __init__(self):
        self.rows: list[Row] = []

    def fix(self, row):
        self.rows.append(row)

    def tick(self, row, leg=None, order=None):
        pass

    def close(self):
        pass


def replay(path: str | Path) -> Replayed:
    """Repeat a recording of `steerway live --record`. Raises InputError for anything else."""
    require_mcap(str(path))
    try:
        with open(path, "rb") as file:
            return _replayed(file, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}), expected a recording of live --record") from None


def _replayed(file, path):
    if file.read(len(MAGIC)) != MAGIC:
        raise InputError(f"{path}: is no MCAP, expected a recording of live --record")
    file.seek(0)
    metadata: dict = {}
    kept, recorded, service, inputs, orders = _Kept(), [], None, 0, 0
    moments = {}
    for message in messages(file):
        if message.topic == LEARNING:
            each = json.loads(message.data)
            moments[each["what"], each["row"]] = True
    file.seek(0)
    for message in messages(file, metadata):
        if SETTINGS not in metadata:
            raise InputError(f"{path}: is no recording of Steerway, expected one of live --record")
        service = service or _service(json.loads(metadata[SETTINGS]["settings"]), kept, moments)
        if message.topic == INPUT:
            inputs += 1
            _feed(service, json.loads(message.data))
        elif message.topic == ESTIMATE:
            recorded.append(Row(*_values(json.loads(message.data), Row)))
        orders += message.topic == ORDER
    if service is not None and len(recorded) > len(kept.rows):
        kept.rows += service.navigator.finish()
    if service is None:
        raise InputError(f"{path}: holds no message, expected a recording of live --record")
    return Replayed(recorded, kept.rows[: len(recorded)] if _is_cut(file) else kept.rows, inputs, orders)


def _is_cut(file):
    """Whether the recording ended without its footer, possibly between an input and its estimate."""
    file.seek(-len(MAGIC), 2)
    return file.read() != MAGIC


def _service(settings, kept, moments):
    profile, latency = _profile(settings.pop("profile")), settings.pop("latency")
    settings |= {"aid": tuple(settings["aid"]), "sources": tuple(settings["sources"])}
    tuning = RepeatedLearning(profile, settings["aid"], moments) if settings.pop("learns", False) else profile
    return Service(Navigator(tuning, **settings), [kept], settings["rate"] or RATE, latency)


def _profile(text):
    if text is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "profile.toml")
        path.write_text(text, encoding="utf-8")
        return load_profile(path)


def _feed(service, values):
    service.opening.chosen = values.pop("chosen")
    arrived = values.pop("arrived")
    service.use(InputRow(*_values(values, InputRow)), math.nan if arrived is None else arrived)


def _values(values, kind):
    for name in kind._fields:
        yield math.nan if values[name] is None else values[name]
