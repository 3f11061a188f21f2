"""Replay of a recording: its inputs pass through the navigator again, which has to give the recorded estimates."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from steerway.core.errors import InputError
from steerway.core.records import Motion
from steerway.core.settings import parse_toml
from steerway.estimation.vessel.profile import Profile
from steerway.formats.mcap import INPUT, MAGIC, messages, require_mcap
from steerway.live.learning import ReplayedLearning
from steerway.live.navigator import Navigator
from steerway.live.outputs.output import Output
from steerway.live.recording import ESTIMATE, LEARNING, ORDER, SETTINGS
from steerway.live.rows import InputRow, Row
from steerway.live.service import RATE, Service

ANOTHER_PROCESSOR = 1e-9
"""Bound of `Replayed.largest` for a recording from another processor. Measured, x86-64 replayed on aarch64: 5e-14 with
a given profile, 6e-12 with an inferred one."""


class Replayed(NamedTuple):
    """Result of a replay. `recorded`: rows at the fixes in the recording; `repeated`: rows from the replay; `inputs`,
    `orders`: numbers of inputs and orders in the recording; `code`: `recording.code` of the recording run, or "".
    """

    recorded: list[Row]
    repeated: list[Row]
    inputs: int
    orders: int
    code: str = ""

    @property
    def differing(self) -> list[Row]:
        """The recorded rows that are not repeated bit by bit, and the rows that exist on one side only."""
        pairs = zip(self.recorded, self.repeated, strict=False)
        unequal = [one for one, other in pairs if np.array(one, float).tobytes() != np.array(other, float).tobytes()]
        n = min(len(self.recorded), len(self.repeated))
        return unequal + self.recorded[n:] + self.repeated[n:]

    @property
    def largest(self) -> tuple[float, str]:
        """The largest difference and its column: absolute in SI units, relative for values above 1. inf if one side has
        no value; (inf, "row") if the numbers of rows differ.

        Another processor rounds sums and products in another order: see ANOTHER_PROCESSOR.
        """
        if len(self.recorded) != len(self.repeated):
            return math.inf, "row"
        one, other = (np.array(rows, float).reshape(-1, len(Row._fields)) for rows in (self.recorded, self.repeated))
        apart = np.abs(one - other) / np.maximum(np.abs(one), 1.0)
        apart[np.isnan(one) & np.isnan(other)] = 0.0
        most = np.max(np.where(np.isnan(apart), math.inf, apart), axis=0, initial=0.0)
        return float(most.max()), Row._fields[int(most.argmax())]

    def motion(self) -> Motion:
        """The repeated rows as `Motion`."""
        columns = dict(zip(Row._fields, np.array(self.repeated, float).reshape(-1, len(Row._fields)).T, strict=True))
        return Motion(**(columns | {"status": columns["status"].astype(np.uint8)}))


class _Kept(Output):
    """An output that keeps the rows of the fixes."""

    def __init__(self) -> None:
        self.rows: list[Row] = []

    def fix(self, row: Row) -> None:
        self.rows.append(row)


def replay(path: str | Path) -> Replayed:
    """Repeat a recording of `steerway live --record`. Raises InputError for any other file."""
    require_mcap(str(path))
    try:
        with open(path, "rb") as file:
            return _replayed(file)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}), expected a recording of live --record") from None


def _replayed(file: BinaryIO) -> Replayed:
    if file.read(len(MAGIC)) != MAGIC:
        raise InputError("is not an MCAP file, expected a recording of live --record")
    file.seek(0)
    metadata: dict[str, Any] = {}
    kept, recorded, service, inputs, orders = _Kept(), [], None, 0, 0
    moments = {}
    for message in messages(file):
        if message.topic == LEARNING:
            each = json.loads(message.data)
            moments[each["what"], each["row"]] = True
    file.seek(0)
    for message in messages(file, metadata):
        if SETTINGS not in metadata:
            raise InputError("is not a recording of Steerway, expected one of live --record")
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
        raise InputError("contains no message, expected a recording of live --record")
    repeated = kept.rows[: len(recorded)] if _is_cut(file) else kept.rows
    return Replayed(recorded, repeated, inputs, orders, metadata[SETTINGS].get("code", ""))


def _is_cut(file: BinaryIO) -> bool:
    """Whether the recording ended without its footer, possibly between an input and its estimate."""
    file.seek(-len(MAGIC), 2)
    return file.read() != MAGIC


def _service(settings: dict[str, Any], kept: _Kept, moments: dict[tuple[str, int], bool]) -> Service:
    text, latency, learns = settings.pop("profile"), settings.pop("latency"), settings.pop("learns", False)
    profile: Any = None if text is None else Profile.made_of(parse_toml(text, "its profile"), "its profile")
    settings |= {"aid": tuple(settings["aid"]), "sources": tuple(settings["sources"])}
    tuning = ReplayedLearning(profile, settings["aid"], moments) if learns else profile
    return Service(Navigator(tuning, **settings), [kept], settings["rate"] or RATE, latency)


def _feed(service: Service, values: dict[str, Any]) -> None:
    service.startup.chosen = values.pop("chosen")
    arrived = values.pop("arrived")
    service.use(InputRow(*_values(values, InputRow)), math.nan if arrived is None else arrived)


def _values(values: dict[str, Any], kind: type[NamedTuple]) -> Iterator[Any]:
    """The fields of a row; NaN for a field that the recording does not have."""
    for name in kind._fields:
        value = values.get(name)
        yield math.nan if value is None else value
