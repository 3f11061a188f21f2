"""A kernel is compiled anew when something that it depends on changes, and only then."""

import os
import subprocess
import sys
import time

import pytest

from steerway.core.testing import kernel_cache


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Writes modules of a package `boats` into a folder that imports find."""
    folder = tmp_path / "boats"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("STEERWAY_CACHE", str(tmp_path / "cache"))
    _forget()

    def write(**sources):
        for name, source in sources.items():
            (folder / f"{name}.py").write_text(source)
        _forget()

    import boats  # noqa: F401

    yield write
    sys.modules.pop("boats")
    _forget()


def _forget():
    for each in (kernel_cache._source, kernel_cache._file, kernel_cache.kernel_cache):
        each.cache_clear()


def test_a_change_in_an_imported_file_is_seen_however_it_is_imported(package):
    package(base="SLOW = 0.3\n", hull="from .base import (\n    SLOW,\n)\n", rudder="x = 1\n")
    for statement in (
        "from boats import hull",
        "import boats.hull as h",
        "from boats.hull import (\n    SLOW as S,\n)",
    ):
        package(base="SLOW = 0.3\n", boat=statement + "\n")
        before = kernel_cache.source_digest("boats.boat")
        package(rudder=f"x = {len(statement)}\n")
        assert kernel_cache.source_digest("boats.boat") == before
        package(base="SLOW = 0.4\n")
        assert kernel_cache.source_digest("boats.boat") != before


def test_a_kernel_of_another_package_depends_on_this_one(package):
    package(boat="from steerway.core.angles import wrap\n")
    alone = kernel_cache.source_digest("boats.boat")
    source = kernel_cache._source
    try:
        kernel_cache._source = lambda name: ("changed", ()) if name == "steerway.core.angles" else source(name)
        assert kernel_cache.source_digest("boats.boat") != alone
    finally:
        kernel_cache._source = source


def test_the_oldest_versions_of_a_module_are_removed(package, tmp_path):
    for k in range(12):
        package(boat=f"x = {k}\n")
        assert kernel_cache.module_directory("boats.boat", "").is_dir()
    assert len(list((tmp_path / "cache" / "steerway" / "kernels" / "boats.boat").iterdir())) == kernel_cache._KEPT


FULL = """
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
from steerway.core import displacement
resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
print(displacement(0.0, 0.0, 0.0, 0.0))
"""


def test_on_a_full_disk_a_kernel_is_compiled_and_not_kept(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", FULL], env=os.environ | {"STEERWAY_CACHE": str(tmp_path)}, capture_output=True, text=True
    )
    assert (done.stdout, done.stderr) == ("(0.0, 0.0)\n", "")
    assert not list(tmp_path.rglob("*.nbc"))


def test_without_a_writable_directory_nothing_is_kept(package, monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("STEERWAY_CACHE", str(tmp_path / "file"))
    _forget()
    assert kernel_cache.module_directory("boats.boat", "") is None


BESIDE = """
import sys, time
from numba.core import event
from steerway.core import displacement
compiled = []
class Seen(event.Listener):
    def on_start(self, each): compiled.append(each.data["dispatcher"].py_func.__name__)
    def on_end(self, _): pass
event.register("numba:compile", Seen())
time.sleep(max(float(sys.argv[1]) - time.time(), 0.0))
displacement(0.0, 0.0, 0.0, 0.0)
print(compiled.count("displacement"))
"""


def test_of_processes_that_begin_together_one_compiles(tmp_path):
    at_once = str(time.time() + 5.0)
    beside = [
        subprocess.Popen(
            [sys.executable, "-c", BESIDE, at_once],
            env=os.environ | {"STEERWAY_CACHE": str(tmp_path)},
            stdout=subprocess.PIPE,
            text=True,
        )
        for _ in range(3)
    ]
    assert sorted(each.communicate()[0] for each in beside) == ["0\n", "0\n", "1\n"]


def test_nobody_waits_for_ever_for_a_process_that_stands(tmp_path, monkeypatch):
    monkeypatch.setattr(kernel_cache, "_LONGEST_WAIT", 0.1)
    with kernel_cache.one_process(tmp_path / "lock"), kernel_cache.one_process(tmp_path / "lock"):
        pass
    with kernel_cache.one_process(tmp_path / "nowhere" / "lock"):
        pass
