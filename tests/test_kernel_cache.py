"""A kernel is compiled anew when something that it depends on changes, and only then."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import steerway
from steerway.core import wrap
from steerway.core.testing import kernel_cache, variation

DIGEST = """
import boats, sys
from steerway.core.testing import kernel_cache
kernel_cache.module_directory("boats.boat", "")
print(kernel_cache.source_digest("boats.boat"))
"""


def python(code, *arguments, **environment):
    """What a process of its own prints; it reads every source anew."""
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], env=os.environ | environment, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


@pytest.fixture
def digest(tmp_path):
    """Writes modules of a package `boats`; returns the digest of its module `boat`, of which a directory is kept."""
    (tmp_path / "boats").mkdir()
    (tmp_path / "boats" / "__init__.py").write_text("")
    shutil.copytree(Path(steerway.__file__).parent / "core", tmp_path / "steerway" / "core")
    (tmp_path / "steerway" / "__init__.py").write_text("")

    def written(**sources):
        for name, source in sources.items():
            (tmp_path / "boats" / f"{name}.py").write_text(source)
        return python(DIGEST, PYTHONPATH=str(tmp_path), STEERWAY_CACHE=str(tmp_path / "cache"))

    return written


@pytest.mark.parametrize(
    "statement", ["from boats import hull", "import boats.hull as h", "from boats.hull import (\n    SLOW as S,\n)"]
)
def test_a_change_in_an_imported_file_is_seen_however_it_is_imported(digest, statement):
    before = digest(base="SLOW = 0.3\n", hull="from .base import (\n    SLOW,\n)\n", boat=statement + "\n")
    assert digest(rudder="x = 1\n") == before
    assert digest(base="SLOW = 0.4\n") != before


def test_a_kernel_of_another_package_depends_on_this_one(digest, tmp_path):
    before = digest(boat=f"from {wrap.__module__} import wrap\n")
    for each, changes in ((variation, False), (wrap, True)):
        with tmp_path.joinpath(*each.__module__.split(".")).with_suffix(".py").open("a") as file:
            file.write("# changed\n")
        assert (digest() != before) == changes


def test_the_oldest_versions_of_a_module_are_removed(tmp_path, monkeypatch):
    monkeypatch.setenv("STEERWAY_CACHE", str(tmp_path))
    kernel_cache.kernel_cache.cache_clear()
    try:
        for k in range(12):
            assert kernel_cache.module_directory(wrap.__module__, f"-{k}").is_dir()
    finally:
        kernel_cache.kernel_cache.cache_clear()
    assert 2 <= len(list((tmp_path / "steerway" / "kernels" / wrap.__module__).iterdir())) <= 10


KERNEL = """
import resource, signal
from steerway.core import wrap
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
print(wrap(7.0) < 1.0)
"""


def test_on_a_full_disk_or_without_a_directory_a_kernel_is_compiled_and_not_kept(tmp_path):
    (tmp_path / "file").write_text("")
    for place in (tmp_path, tmp_path / "file"):
        assert python(KERNEL, STEERWAY_CACHE=str(place)) == "True\n"
    assert not list(tmp_path.rglob("*.nbc"))


BESIDE = """
import sys
from numba.core import event
from steerway.core import wrap
compiled = []
class Seen(event.Listener):
    def on_start(self, each): compiled.append(each.data["dispatcher"].py_func.__name__)
    def on_end(self, _): pass
event.register("numba:compile", Seen())
print("ready", flush=True)
sys.stdin.readline()
wrap(7.0)
print(compiled.count("wrap"))
"""


def test_of_processes_that_begin_together_one_compiles(tmp_path):
    environment = os.environ | {"STEERWAY_CACHE": str(tmp_path)}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    beside = [subprocess.Popen([sys.executable, "-c", BESIDE], env=environment, **pipes) for _ in range(3)]
    assert [each.stdout.readline() for each in beside] == ["ready\n"] * 3
    for each in beside:
        each.stdin.write("\n")
        each.stdin.flush()
    assert sorted(each.communicate()[0] for each in beside) == ["0\n", "0\n", "1\n"]
