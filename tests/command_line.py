"""The command line, as a user calls it."""

import subprocess
import sys

STEERWAY = [sys.executable, "-c", "from steerway.commands.cli import main; main()"]


def run(*arguments, stdin=None, stdout=subprocess.PIPE):
    """(exit code, standard output, standard error) of a command."""
    done = subprocess.run([*STEERWAY, *map(str, arguments)], input=stdin, stdout=stdout, stderr=subprocess.PIPE)
    return done.returncode, (done.stdout or b"").decode(), done.stderr.decode()
