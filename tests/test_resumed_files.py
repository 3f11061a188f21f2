"""What `--resume` reads is data: whatever a file holds, nothing in it is run."""

import base64
import io
import json
import os
import pickle
import re
import sys
import zlib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

import steerway
from steerway.core.testing import in_workers
from steerway.simulation import Unfinished

SOURCES = Path(steerway.__file__).parents[1]


def test_no_source_unpickles_a_file():
    """Worker processes exchange pickled objects over their own pipes, of bytes that never were in a file."""
    found = {}
    for path in SOURCES.rglob("*.py"):
        words = re.findall(r"Unpickler|pickle\.loads?\b|allow_pickle", path.read_text(encoding="utf-8"))
        if words:
            found[str(path.relative_to(SOURCES))] = set(words)
    assert found == {f"{in_workers.__module__.replace('.', '/')}.py": {"pickle.loads"}}


class Harm:
    """Unpickled, it would make a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.system, (f"touch {self.path}",)


def entry(text):
    """A line as the format has them, its checksum right."""
    return b"%08x %b\n" % (zlib.crc32(text), text)


def crafted(harm):
    """Entries of somebody else's making, and entries that were cut off."""
    program = json.dumps({"tuple": [1, {"object": ["steerway.__main__", "main", {"dict": []}]}]}).encode()
    call = json.dumps({"tuple": [1, {"object": ["os", "system", {"tuple": [f"touch {harm}"]}]}]}).encode()
    opened = json.dumps({"tuple": [1, {"object": ["subprocess", "Popen", {"dict": [["args", "true"]]}]}]}).encode()
    through = json.dumps({"tuple": [1, {"object": [in_workers.__module__, "os.system", {"dict": []}]}]}).encode()
    objects = np.array([Harm(harm)], dtype=object)
    file = io.BytesIO()
    np.save(file, objects, allow_pickle=True)
    array = json.dumps({"tuple": [1, {"array": base64.b64encode(file.getvalue()).decode()}]}).encode()
    return [
        pickle.dumps((1, Harm(harm))),
        entry(pickle.dumps((1, Harm(harm))).replace(b"\n", b" ")),
        *map(entry, (program, call, opened, through, array)),
        entry(b'{"tuple": [1, 2]}')[:-1],
        entry(b'{"tuple": [1, 2]}')[:-5],
        *map(entry, (b"[" * 100_000, b"{}", b'{"tuple": 5}', b'{"tuple": [{"dict": []}, 1]}', b"1e999")),
    ]


@pytest.mark.parametrize("k", range(14))
def test_a_crafted_or_cut_entry_runs_nothing_and_is_overwritten(k, tmp_path):
    path, harm = tmp_path / "work.unfinished", tmp_path / "harm"
    Unfinished(path, {"work": "w"}).add(3, "kept")
    with open(path, "ab") as file:
        file.write(crafted(harm)[k])
    work = Unfinished(path, {"work": "w"}, resume=True, packages=("tests",))
    assert work.results == {3: "kept"} and not harm.exists()
    work.add(7, 1.5)
    assert Unfinished(path, {"work": "w"}, resume=True).results == {3: "kept", 7: 1.5}


@dataclass(frozen=True)
class Kept:
    """A result of a study."""

    values: np.ndarray
    words: dict = field(default_factory=dict)


def test_what_studies_give_comes_back_in_every_bit(tmp_path):
    path = tmp_path / "work.unfinished"
    work = Unfinished(path, {"work": "w"})
    rng = np.random.default_rng(3)
    table = np.zeros(2, dtype=[("a", "<f8"), ("b", "<i4", (2,))])
    given = {
        b"key": Kept(rng.standard_normal((3, 2)), {("a", 1): {1, 2}, None: frozenset("x")}),
        ("tuple", 2): [np.float32(0.1), np.int64(-5), np.bool_(True), -0.0, float("inf"), 1 + 2j, 10**30],
        3: np.array(["north", "ü"]),
        4: table,
        5: np.asfortranarray(rng.standard_normal((4, 3)))[::2],
    }
    for key, result in given.items():
        work.add(key, result)
    found = Unfinished(path, {"work": "w"}, resume=True, packages=("tests",)).results
    assert list(found) == list(given)
    assert isinstance(found[b"key"], Kept) and found[b"key"].words == given[b"key"].words
    np.testing.assert_array_equal(found[b"key"].values, given[b"key"].values)
    assert list(map(repr, found["tuple", 2])) == list(map(repr, given["tuple", 2]))
    assert list(map(type, found["tuple", 2])) == list(map(type, given["tuple", 2]))
    for k in (3, 4, 5):
        assert found[k].dtype == given[k].dtype and found[k].tobytes() == given[k].tobytes()


def test_what_is_more_than_data_is_made_again(tmp_path):
    path = tmp_path / "work.unfinished"
    work = Unfinished(path, {"work": "w"})
    for key, result in ((1, lambda: 0), (2, sys), (3, np.array([None], dtype=object)), (4, "data")):
        work.add(key, result)
    assert list(work.results) == [1, 2, 3, 4]
    assert Unfinished(path, {"work": "w"}, resume=True).results == {4: "data"}
