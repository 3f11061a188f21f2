"""The command line, as a user calls it."""

import io
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from unittest.mock import patch

from steerway.commands.testing import cli

STEERWAY = [sys.executable, "-m", "steerway"]


def run(*arguments, stdin=b""):
    """(exit code, standard output, standard error) of a command in this process, which saves a second of starting."""
    out, err = (io.TextIOWrapper(io.BytesIO(), "utf-8", write_through=True) for _ in range(2))
    given = patch.multiple(sys, argv=["steerway", *map(str, arguments)], stdin=io.TextIOWrapper(io.BytesIO(stdin)))
    code = None
    with given, redirect_stdout(out), redirect_stderr(err):
        try:
            cli.main()
        except SystemExit as end:
            code = end.code
    return code, *(each.buffer.getvalue().decode() for each in (out, err))


def run_process(*arguments, stdout=subprocess.PIPE):
    """The same of a process of its own."""
    done = subprocess.run([*STEERWAY, *map(str, arguments)], stdout=stdout, stderr=subprocess.PIPE)
    return done.returncode, (done.stdout or b"").decode(), done.stderr.decode()
