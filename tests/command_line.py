"""The command line, as a user calls it."""

import subprocess
import sys

STEERWAY = [sys.executable, "-c", "from steerway.commands.cli import main; main()"]


def run(*arguments, stdin=None):
    """(exit code, standard output, standard error) of a command."""
    done = subprocess.run([*STEERWAY, *map(str, arguments)], input=stdin, capture_output=True)
    return done.returncode, done.stdout.decode(), done.stderr.decode()
