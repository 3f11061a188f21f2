"""`make bounds`: the tests that call kernels, with kernels run by the interpreter, where NumPy checks every index.

A plugin of pytest, `-p tests.bounds`. Kernels are some hundred times slower than compiled, so that a test is ended
after a second, and nothing but indices is judged: an IndexError within a kernel fails, also one that the test expects.
At the end every kernel must have returned at least once.
"""

import functools
import importlib
import os
import pkgutil
import signal
from collections.abc import Callable

import pytest

os.environ["NUMBA_DISABLE_JIT"] = "1"

import steerway
import steerway_studies
from steerway.core.testing import compiled

SETUP, CALL = 5.0, 1.0
"""Seconds of the processor for fixtures and for a test; three times as long where they wait."""

_kernels: set[str] = set()
_returned: set[str] = set()
_findings: list[str] = []


class _TimeUp(BaseException):
    """A test or a fixture has run long enough."""


def _checked(function: Callable, **_) -> Callable:
    """In place of compilation: notes that a kernel returned, or that it used an index that is not there."""
    name = f"{function.__module__}.{function.__qualname__}"
    _kernels.add(name)

    @functools.wraps(function)
    def called(*arguments):
        try:
            result = function(*arguments)
        except IndexError as error:
            _findings.append(f"{name}: {error}")
            raise
        _returned.add(name)
        return result

    return called


compiled._compiled = _checked


def _end(*_) -> None:
    raise _TimeUp


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item):
    """Fixtures have SETUP seconds."""
    return (yield from _limited(SETUP))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item):
    """A test has CALL seconds. It fails by what was found in it, and by nothing else."""
    yield from _limited(CALL)
    found = "\n".join(dict.fromkeys(_findings))
    _findings.clear()
    if found:
        pytest.fail(found, pytrace=False)


def _limited(seconds):
    for number, timer, limit in ((signal.SIGPROF, signal.ITIMER_PROF, 1.0), (signal.SIGALRM, signal.ITIMER_REAL, 3.0)):
        signal.signal(number, _end)
        signal.setitimer(timer, limit * seconds, 1.0)  # again each second: in a destructor it is ignored
    try:
        yield
    except (KeyboardInterrupt, pytest.exit.Exception):
        raise
    except BaseException:
        return
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.setitimer(signal.ITIMER_REAL, 0.0)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    """A finding fails a test also where it is expected to fail, and a test that passes against that passes."""
    report = yield
    if report.when == "call" and hasattr(report, "wasxfail"):
        del report.wasxfail
    if call.excinfo is None:
        report.outcome, report.longrepr = "passed", None
    elif report.when == "call":
        report.outcome = "failed"
    return report


def pytest_sessionfinish(session):
    """A worker sends what it called; without workers, or as the last, what nobody called fails."""
    output = getattr(session.config, "workeroutput", None)
    if output is not None:
        output["returned"] = sorted(_returned)
        return
    for package in (steerway, steerway_studies):
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            importlib.import_module(module.name)
    if not session.config.option.collectonly and _never():
        session.exitstatus = 1


def pytest_testnodedown(node, error):
    """Join what a worker called."""
    _returned.update(getattr(node, "workeroutput", {}).get("returned", ()))


def _never() -> list[str]:
    return sorted(name for name in _kernels - _returned if name.startswith("steerway"))


def pytest_terminal_summary(terminalreporter):
    """Kernels of which no call returned."""
    never = _never()
    terminalreporter.write_line(
        f"{len(_kernels) - len(never)} kernels returned with every index checked, {len(never)} were not called"
    )
    for name in never:
        terminalreporter.write_line(f"not called: {name}")
