"""Runs a command until a signal stops it, with its log on standard error."""

import asyncio
import contextlib
import logging
import os
import signal
import sys
from collections.abc import Coroutine
from typing import Any

from steerway.core.errors import InputError, printable


class OneLine(logging.Formatter):
    """Formats a message as one line: control characters, as in names of devices and vessels, are escaped."""

    def format(self, record: logging.LogRecord) -> str:
        """See logging.Formatter; a traceback keeps its lines."""
        record.message = printable(record.getMessage())
        text = self.formatMessage(record)
        return f"{text}\n{self.formatException(record.exc_info)}" if record.exc_info else text


def log_to_stderr(command: str) -> None:
    """Print the log of the live package under the command's name."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(OneLine(f"{command}: %(message)s"))
    log = logging.getLogger("steerway.live")
    log.handlers[:] = [handler]
    log.setLevel(logging.INFO)
    log.propagate = False


def until_stopped(work: Coroutine[Any, Any, None]) -> None:
    """Run to the end, until SIGINT or SIGTERM, or until standard output is closed. Raises the first InputError."""

    async def run() -> None:
        task = asyncio.ensure_future(work)
        loop = asyncio.get_running_loop()
        for each in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(each, task.cancel)
        with contextlib.suppress(asyncio.CancelledError):
            await task

    refused = ""
    try:
        asyncio.run(run())
    except* InputError as group:
        first: BaseException = group
        while isinstance(first, BaseExceptionGroup):  # links run in task groups of their own
            first = first.exceptions[0]
        refused = str(first)
    except* BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    if refused:
        raise InputError(refused)
