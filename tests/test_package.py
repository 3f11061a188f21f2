"""The front door: public names, documented; the core suffices; kernels are compiled anew when they change alone."""

import ast
import inspect
import math
import os
import pkgutil
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import steerway
import steerway_studies
from steerway.core import wrap
from steerway.core.testing import variation
from tests.fuzz import seeds
from tests.messages import WHOLE
from tests.scenes import turning

COMMANDS = """
import sys
sys.modules.update(dict.fromkeys({without}))
from steerway.__main__ import main
for arguments in {commands}:
    sys.argv[1:] = arguments
    try:
        main()
    except SystemExit as end:
        print(f"\\nended with {{end.code}}")
"""
"""Several in one process, which saves a second of starting each."""


def process(*command, **environment):
    """Standard output and standard error of a process that ends well."""
    environment = os.environ | {name: str(value) for name, value in environment.items()}
    done = subprocess.run([sys.executable, *command], env=environment, capture_output=True, text=True, check=True)
    return done.stdout, done.stderr


def ends(commands, without=(), **environment):
    """The exit codes of commands, and what they said on standard error."""
    commands = [[str(each) for each in arguments] for arguments in commands]
    out, err = process("-c", COMMANDS.format(without=without, commands=commands), **environment)
    return [int(each.split()[-1]) for each in out.splitlines() if each.startswith("ended with")], err


def test_degrees_in_place_of_radians_and_a_log_without_motion_are_refused():
    estimator = steerway.FiveStateFilter()
    for latitude, longitude in ((63.43, 10.39), (0.5, 10.39)):
        with pytest.raises(steerway.InputError, match="update takes radians: l"):
            estimator.update(latitude, longitude)
    estimator.update(math.radians(63.43), math.radians(10.39))
    with pytest.raises(steerway.InputError, match=r"Fixes.latitude has 63\.4 rad"):
        steerway.Fixes(np.arange(2.0), np.full(2, 63.4), np.full(2, 10.3))
    for count, found in ((1, "1 position"), (3, "3 positions at one time")):
        with pytest.raises(steerway.InputError, match=f"has {found}, expected at least two at different times"):
            steerway.estimate(steerway.Fixes(*np.full((3, count), 0.5)))


def test_information_help_and_lists_compile_nothing(tmp_path):
    logs = {kind.__name__: kind()[0] for kind in (seeds.nmea, seeds.ubx, seeds.canboat, seeds.ais, seeds.csv)}
    for name, data in (logs | {"gpx": WHOLE}).items():
        (tmp_path / name).write_bytes(data)
    commands = [["info", tmp_path / name] for name in (*logs, "gpx")]
    commands += [["--help"], ["estimate", "--help"], ["profile", "list"], ["profile", "show", "otter"]]
    kept = tmp_path / "kernels"
    assert ends(commands, STEERWAY_CACHE=kept) == ([0] * len(commands), "")
    assert list(kept.rglob("*.nb?")) == []
    process("-c", "from steerway.core import displacement; displacement(0.0, 0.0, 0.0, 0.0)", STEERWAY_CACHE=kept)
    assert list(kept.rglob("*.nb?")), "an empty cache is seen to fill"


EXTRAS = ("scipy", "sklearn", "distributed", "websockets", "nicegui", "pymavlink", "daqp", "matplotlib", "bokeh")


def test_without_the_extras_a_log_is_estimated_a_scenario_simulated_and_what_is_missing_named(tmp_path):
    log, scenario, staircase = (tmp_path / name for name in ("log.csv", "short.toml", "staircase.csv"))
    steerway.write(turning(2.0, 0.5, 60.0).fixes(0.3, 1), log)
    scenario.write_text(
        "duration = 10.0\n[route]\nwaypoints = [{ north = 0.0, east = 0.0 }, { north = 50.0, east = 0.0 }]\n"
    )
    rows = "".join(f"{k},{1.0 + 0.01 * k},{2.0 + 0.02 * k}\n" for k in range(200))
    staircase.write_text("time_s,speed_mps,shaft_rps\n" + rows)
    commands = [
        ["estimate", log, "--smooth", "--profile", "small-usv"],
        ["simulate", scenario, "-o", tmp_path / "sailed", "--nmea"],
        ["identify", "surge", staircase],
        ["estimate", log, "--profile", "small-usv", "--report", tmp_path / "report.html"],
        ["estimate", log, "--profile", "small-usv", "--report", tmp_path / "report.png"],
    ]
    codes, said = ends(commands, EXTRAS)
    assert codes == [0, 0, 2, 2, 2]
    assert "To add figures to this page: pip install" in (tmp_path / "sailed" / "index.html").read_text()
    needs = "steerway: this needs the package {}, expected pip install '.[{}]' in a clone of steerway"
    wanted = ("scipy", "identify"), ("bokeh", "report"), ("matplotlib", "report")
    assert said.splitlines()[-3:] == [needs.format(*each) for each in wanted]


PACKAGES = [
    *(
        f"steerway.{room}"
        for room in "core control guidance pilot sensors vessels simulation report identification estimation".split()
    ),
    *(f"steerway.estimation.{room}" for room in "heading speed positioning steering".split()),
]
FOLDER = Path(steerway.__file__).parents[1]
MODULES = [
    ".".join(path.relative_to(FOLDER).with_suffix("").parts)
    for path in sorted((FOLDER / "steerway" / "estimation").rglob("[!_]*.py"))
    if "\n__all__ = " in path.read_text(encoding="utf-8")
]
"""That are public themselves: they list their public names."""
PUBLIC = ["steerway", *PACKAGES, *MODULES]
STUDIES = Path(steerway_studies.__file__).parent


def unlisted(source: str) -> list[str]:
    """Names that this source imports from steerway and that no `__all__` lists."""
    imports = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ImportFrom)]
    of_steerway = [
        (node.module, each.name) for node in imports for each in node.names if f"{node.module}.".startswith("steerway.")
    ]
    return [each for each in of_steerway if each[0] not in PUBLIC or each[1] not in import_module(each[0]).__all__]


def test_studies_use_public_names_only():
    sources = set(STUDIES.rglob("*.py")) - {STUDIES / "testing.py"}
    found = {f"{path}": unlisted(path.read_text(encoding="utf-8")) for path in sources}
    assert len(found) > 5 and {name: each for name, each in found.items() if each} == {}


@pytest.mark.parametrize("room", PUBLIC)
def test_every_public_name_loads_and_is_documented(room):
    package = import_module(room)
    modules = {each.name for each in pkgutil.iter_modules(getattr(package, "__path__", ()))}
    assert not modules & set(package.__all__), "of two with one name an import gives now one, now the other"
    assert len(set(package.__all__)) == len(package.__all__)
    for name in package.__all__:
        value = getattr(package, name)
        described = inspect.isclass(value) or inspect.isroutine(value) or hasattr(value, "py_func")
        assert not described or inspect.getdoc(getattr(value, "py_func", value)), f"{room}.{name} has no docstring"
    if room not in MODULES:
        assert set(package.__all__) <= set(dir(package))
        with pytest.raises(AttributeError, match="has no attribute 'no_such_name'"):
            _ = package.no_such_name


LIGHT = {
    f"import {', '.join(PACKAGES)}": ("numba", "scipy", "polars", "pydantic", "matplotlib"),
    "from steerway.live.testing import build_service": ("polars", "pandas"),  # it starts a fifth sooner without
    "from steerway.live.testing import RunningBoat": ("polars", "pandas"),
    # The page's process beside the service's has to fit into a small computer.
    "from steerway.live.testing import server, access, page": ("numba", "numpy", "scipy"),
}


@pytest.mark.parametrize("statement", LIGHT)
def test_packages_that_are_not_needed_are_not_loaded(statement):
    """Names are loaded when they are asked for, and what runs aboard does without what makes it slow or large."""
    loaded = f"{statement}; import sys; print([name for name in {LIGHT[statement]} if name in sys.modules])"
    assert process("-c", loaded)[0] == "[]\n"


DIGEST = """
import boats, sys
from steerway.core.testing import kernel_cache
kernel_cache.module_directory("boats.boat", "")
print(kernel_cache.source_digest("boats.boat"))
"""


@pytest.fixture
def digest(tmp_path):
    """Writes modules of a package `boats`; returns the digest of its module `boat`, of which a directory is kept."""
    (tmp_path / "boats").mkdir()
    (tmp_path / "boats" / "__init__.py").write_text("")
    shutil.copytree(FOLDER / "steerway" / "core", tmp_path / "steerway" / "core")
    (tmp_path / "steerway" / "__init__.py").write_text("")

    def written(**sources):
        for name, source in sources.items():
            (tmp_path / "boats" / f"{name}.py").write_text(source)
        return process("-c", DIGEST, PYTHONPATH=tmp_path, STEERWAY_CACHE=tmp_path / "cache")[0]

    return written


def test_a_change_in_an_imported_file_is_seen_however_it_is_imported_and_from_whatever_package(digest, tmp_path):
    for statement in (
        "from boats import hull",
        "import boats.hull as h",
        "from boats.hull import (\n    SLOW as S,\n)",
    ):
        before = digest(base="SLOW = 0.3\n", hull="from .base import (\n    SLOW,\n)\n", boat=statement + "\n")
        assert digest(rudder="x = 1\n") == before
        assert digest(base="SLOW = 0.4\n") != before
    before = digest(boat=f"from {wrap.__module__} import wrap\n")
    for each, changes in ((variation, False), (wrap, True)):
        with tmp_path.joinpath(*each.__module__.split(".")).with_suffix(".py").open("a") as file:
            file.write("# changed\n")
        assert (digest() != before) == changes


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
        assert process("-c", KERNEL, STEERWAY_CACHE=place) == ("True\n", "")
    assert not list(tmp_path.rglob("*.nbc"))
