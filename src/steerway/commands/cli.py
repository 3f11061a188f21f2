"""The entry point of the command line. Errors are one line; exit code 2: wrong input, 1: refused by the system.

Signal handlers are installed before anything else is imported.
"""

import os
import sys
from typing import Any

from steerway.commands import interruption


def main() -> None:
    """Run the command line."""
    with interruption.handled():
        code = _run()
        try:
            sys.stdout.flush()
        except OSError as error:
            code = _output_refused(error)
    sys.exit(code)


def _run() -> int:
    import typer

    from steerway.commands.app import command_tree
    from steerway.core import compiling
    from steerway.core.errors import InputError
    from steerway.core.extras import extra_of, missing

    compiling.announce = _announce_compilation
    try:
        return command_tree()(standalone_mode=False, prog_name="steerway") or 0
    except InputError as error:
        return _failed(error, 2)
    except typer.Abort:
        return _failed("interrupted", 130)
    except ModuleNotFoundError as error:
        package = (error.name or "").split(".")[0]
        extra = extra_of(package)
        if extra is None:
            raise
        return _failed(missing("this", package, extra), 2)
    except ChildProcessError as error:
        return _failed(error, 1)
    except OSError as error:
        return _output_refused(error)
    except MemoryError:
        return _failed(
            "out of memory, expected a smaller log, a shorter interval (--from, --until) or a lower --rate", 1
        )
    except Exception as error:
        if not hasattr(error, "format_message"):
            raise
        message = _usage_message(error)
        return _failed(message, 2) if message else 2


def _usage_message(error: Any) -> str:
    """One sentence about an error of the command line; "" if the help was printed. A value of the wrong type gets the
    same words as in a settings file.
    """
    from steerway.core.settings import expectation

    if not hasattr(error.__cause__, "errors"):
        return str(error.format_message())
    problem = error.__cause__.errors()[0]
    return f"{error.param.opts[0]} is {problem['input']!r}, {expectation(problem)}"


def _announce_compilation() -> None:
    if sys.stderr.isatty():
        print("compiling: takes 20 to 60 s, once per installation", file=sys.stderr)


def _failed(why: object, code: int) -> int:
    from steerway.core.errors import printable

    print(f"steerway: {printable(str(why))}", file=sys.stderr)
    return code


def _output_refused(error: OSError) -> int:
    """Drop buffered output and return the exit code: silently for a closed pipe, else with a message."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    if isinstance(error, BrokenPipeError):
        return 1
    where = error.filename or "standard output"
    return _failed(f"cannot read or write {where!r}: {error.strerror or error}", 1)
