"""Public names: what the `__all__` of `steerway`, of a package in it or of a public module lists. The studies need no
others, which shows that they suffice."""

import ast
import inspect
import pkgutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import steerway
import steerway_studies

PACKAGES = [
    *(
        f"steerway.{room}"
        for room in "core control guidance sensors vessels simulation report identification estimation".split()
    ),
    *(f"steerway.estimation.{room}" for room in "heading heading.interval speed positioning steering".split()),
]
MODULES = ["steerway.build", "steerway.pilot", "steerway.estimation.heading.composite"]
"""That are public themselves."""
OF_CLASSES = "__dataclass_fields__", "_fields", "_replace"
"""What the standard library makes of a class and documents."""
PUBLIC = ["steerway", *PACKAGES, *MODULES]
STUDIES = Path(steerway_studies.__file__).parent


def unlisted(source: str) -> list[str]:
    """Names of steerway that this source uses and no `__all__` lists, and private attributes of other objects."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "steerway":
            public = import_module(node.module).__all__ if node.module in PUBLIC else ()
            found += [f"{node.module}.{each.name}" for each in node.names if each.name not in public]
        elif isinstance(node, ast.Import):
            found += [each.name for each in node.names if each.name.startswith("steerway.")]
        elif isinstance(node, ast.Attribute):
            owner = ast.unparse(node.value)
            own = owner in ("self", "cls", "super()") or node.attr in OF_CLASSES
            private = node.attr.startswith("_") and not own
            if private or (owner == "steerway" and node.attr not in steerway.__all__):
                found.append(f"{owner}.{node.attr}")
    return found


def test_the_walk_finds_what_is_not_public():
    assert unlisted("from steerway.control.course import AnglePID") == ["steerway.control.course.AnglePID"]
    assert unlisted("from steerway.control import AnglePID, course") == ["steerway.control.course"]
    assert unlisted("def f():\n    import steerway.core.angles") == ["steerway.core.angles"]
    assert unlisted("self._a = mpc.observer._output") == ["mpc.observer._output"]
    assert unlisted("import steerway\nsteerway.estimate\nsteerway.pilots") == ["steerway.pilots"]


def test_studies_use_public_names_only():
    sources = set(STUDIES.rglob("*.py")) - {STUDIES / "testing.py"}
    found = {path.name: unlisted(path.read_text(encoding="utf-8")) for path in sources}
    assert len(found) > 5 and {name: each for name, each in found.items() if each} == {}


@pytest.mark.parametrize("room", PACKAGES + MODULES)
def test_every_public_name_loads_and_is_documented(room):
    package = import_module(room)
    modules = {each.name for each in pkgutil.iter_modules(getattr(package, "__path__", ()))}
    assert not modules & set(package.__all__), "of two with one name an import gives now one, now the other"
    assert len(set(package.__all__)) == len(package.__all__)
    for name in package.__all__:
        value = getattr(package, name)
        described = inspect.isclass(value) or inspect.isroutine(value) or hasattr(value, "py_func")
        assert not described or inspect.getdoc(getattr(value, "py_func", value)), f"{room}.{name} has no docstring"
    if room in PACKAGES:
        assert dir(package) == sorted(package.__all__)
        with pytest.raises(AttributeError, match="has no attribute 'no_such_name'"):
            _ = package.no_such_name


def test_importing_a_room_loads_none_of_its_modules():
    heavy = "numba", "scipy", "polars", "pydantic", "matplotlib"
    code = f"import sys, steerway, {', '.join(PACKAGES)}; print([each for each in {heavy} if each in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def functions_of(value):
    """The functions that a public name stands for: itself, or the public methods and properties of a class."""
    if not inspect.isclass(value):
        return [getattr(value, "py_func", value)] if inspect.isfunction(getattr(value, "py_func", value)) else []
    members = [member for name, member in vars(value).items() if name == "__init__" or not name.startswith("_")]
    members = [each.fget if isinstance(each, property) else getattr(each, "__func__", each) for each in members]
    return [each for each in members if inspect.isfunction(each) and each.__module__.startswith("steerway.")]


@pytest.mark.parametrize("room", PUBLIC)
def test_every_public_signature_is_annotated(room):
    """Inputs and outputs; that the types are right is the type checker's part, in `make lint`."""
    found = []
    for value in (getattr(import_module(room), name) for name in import_module(room).__all__):
        for function in functions_of(value):
            signature = inspect.signature(function)
            types = [each.annotation for each in signature.parameters.values() if each.name not in ("self", "cls")]
            if function.__name__ != "__init__":
                types.append(signature.return_annotation)
            if inspect.Signature.empty in types:
                found.append(function.__qualname__)
    assert found == []
