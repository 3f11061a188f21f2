"""Faults of receivers, boats, links and files that once did harm: the result of each before the repair, and now.

`python -m tests.faults.aboard [WORD]` tries the faults whose name contains WORD. Without WORD it tries all and rewrites
the table of docs/faults.md. Its exit code is 1 if a result is not as expected.
"""

import logging
import math
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from steerway.estimation.testing import taken_up
from tests import test_absurd_rows as absurd
from tests import test_integrity as integrity
from tests.desk import OTTER, Desk, dock_all, square
from tests.faults import table

HERE = "python -m tests.faults.aboard"
TABLE_IN_DOCS = (
    Path(__file__).parents[2] / "docs" / "faults.md",
    f"<!-- faults: {HERE} -->",
    "<!-- end of faults aboard -->",
    ("| what is wrong | before | now | expected | tried by |", "|---|---|---|---|---|"),
)


class Found(NamedTuple):
    """The result of a fault in words, and whether it is as expected."""

    said: str
    reached: bool


class Fault(NamedTuple):
    """A fault. `tried()` returns its result; `command` tries it alone."""

    name: str
    before: str
    expected: str
    tried: Callable[[], Found]
    command: str = ""


def _frozen(held):
    def tried():
        desk = Desk(square(boat=OTTER, hold_radius=3.0), current=0.4)
        desk.start()
        desk.sail(60.0 if held else 20.0)
        if held:
            desk.autopilot.guide.hold_position()
            desk.sail(30.0)
        place = desk.state[6:8].copy()
        integrity.frozen(desk)
        doubted, stopped = integrity.until_doubted_and_stopped(desk, 30.0)
        metres = math.dist(place, desk.state[6:8])
        reached = stopped <= 5.0 and (held or doubted <= 2.2)
        return Found(f"doubted after {doubted:.1f} s, stopped after {stopped:.1f} s and {metres:.1f} m", reached)

    return tried


def _turns(fault, since=25.0):
    def tried():
        ordered, reason = integrity.ordered_until_stopped(integrity.TURNS[fault], since)
        return Found(f"stopped after {ordered:.1f} s of turn orders: {reason}", ordered <= 20.0)

    return tried


def _absurd_numbers():
    absurd.test_no_number_of_any_link_ends_the_service_or_stays()
    return Found(f"{len(absurd.MESSAGES)} messages; the service goes on, every order is a number", True)


def _strong_current():
    found = [integrity.until_carried_off(direction) for direction in (0.0, 0.7, 2.3, math.pi)]
    seconds, metres = (max(each) for each in zip(*found, strict=True))
    return Found(f"stopped within {seconds:.0f} s and {metres:.0f} m, in four directions", metres <= 60.0)


def _noise(decays):
    """Error of the variance of a first-order process after `decays` time constants."""

    def tried():
        expected = -0.5 * math.expm1(-2.0 * decays)
        error = taken_up(complex(-1.0), True, decays).added / expected - 1.0
        return Found(f"{100.0 * error:+.4f} %", abs(error) < 1e-4)

    return tried


def _by_tests(nodes):
    """Whether all tests pass; an xfailed test counts as missed."""

    def tried():
        command = [sys.executable, "-m", "pytest", "-q", "-n0", "-p", "no:cacheprovider", *nodes.split()]
        output = subprocess.run(command, capture_output=True, text=True).stdout
        counts = dict(
            (word, int(n)) for n, word in re.findall(r"(\d+) (passed|failed|xfailed|errors?|skipped)", output)
        )
        said = ", ".join(f"{n} {word}" for word, n in counts.items()) or "no result"
        return Found(said, counts.keys() == {"passed"})

    return tried


def _tests(name, before, expected, nodes):
    return Fault(name, before, expected, _by_tests(f"-v {nodes}"), f"pytest {nodes}")


FAULTS = (
    Fault("the receiver's position freezes under way", "went on for 77 s, 64 to 84 m", "stopped in 5 s",
          _frozen(held=False)),
    Fault("the same while a position is held", "never stopped in 120 s, up to 45 m off", "stopped in 5 s",
          _frozen(held=True)),
    Fault("yaw reversed", "after 91 s or never, 57 to 150 m off", "within 20 s of orders to turn (5 °/s or more)",
          _turns("reversed")),
    Fault("yaw reversed after 28 s", "after 69.8 s", "within 20 s of turn orders", _turns("reversed", 28.0)),
    Fault("yaw ignored", "after 91 s or never", "within 20 s of turn orders", _turns("ignored")),
    Fault("yaw stuck", "after 91 s or never", "within 20 s of turn orders", _turns("stuck")),
    Fault("a second program steers", "after 91 s or never", "within 20 s of turn orders", _turns("a second master")),
    _tests("yaw reversed or ignored at twenty moments each", "after 8 s or never", "each within 20 s of turn orders",
           "tests/test_integrity.py -k whenever -m study"),
    Fault("impossible numbers on any link", "ended the service, or NaN for ever", "the service goes on",
          _absurd_numbers),
    _tests("a crafted file for --resume", "could run any command", "nothing runs", "tests/test_resumed_files.py"),
    _tests("the Signal K plugin without its token, or after a line `null`", "ended the server", "the server goes on",
           "tests/test_strangers.py -k plugin"),
    _tests("a stranger's ten bytes before every fifth datagram", "9 of 500 messages were received", "500 of 500",
           "tests/test_strangers.py -k costs_no_message"),
    _tests("a drone is heard before the boat", "the drone was the vehicle until a restart", "the boat is the vehicle",
           "tests/test_strangers.py -k drone"),
    _tests("the density of the next fix, in every state of the filter", "integrated to 1.997", "1 within 1 %",
           "tests/test_receiver.py -k integrates"),
    _tests("ten manoeuvres, smoothed and causal", "SOG error in a slalom: 0.046, causal 0.032 m/s",
           "smoothed is no worse", "tests/studies/test_manoeuvres.py -m study"),
    _tests("two commands write into one directory", "results were mixed", "the second is refused",
           "tests/test_archive.py tests/test_campaign.py -k second"),
    Fault("variance of a process after ten time constants", "42 % too small", "exact", _noise(10.0)),
    Fault("variance of a process after five time constants", "7 % too small", "exact", _noise(5.0)),
    _tests("digits of other scripts in a coordinate", "ended in a traceback", "refused in one sentence",
           "tests/test_user_mistakes.py -k scripts"),
    _tests("the helm page behind a TLS proxy", "refused", "served", "tests/test_live_helm.py -k proxy"),
    _tests("an output of mode 0600 is replaced", "became 0644", "stays 0600", "tests/test_writing.py -k permissions"),
    _tests("a token file that other users can read", "no warning", "a warning", "tests/test_live_control.py -k secret"),
    _tests("deep JSON, forged lines, idle strangers and clients that do not read, on the control port", "blocked it",
           "only their own connection ends", "tests/test_live_control.py -k port"),
    Fault("a current of 3.5 m/s, boat of 3 m/s", "stopped after 71 s and 226 m", "within 60 m", _strong_current),
)  # fmt: skip


def line(fault: Fault, found: Found) -> str:
    """A line of the table."""
    said = found.said if found.reached else f"**missed**: {found.said}"
    return f"| {fault.name} | {fault.before} | {said} | {fault.expected} | `{command_of(fault)}` |"


def command_of(fault: Fault) -> str:
    """The command that tries a fault alone."""
    return fault.command or f'{HERE} "{fault.name}"'


def in_docs() -> list[str]:
    """The table's lines in the docs."""
    return table.in_docs(*TABLE_IN_DOCS)


def main() -> int:
    """Try all faults, or those with a word in the name; return 1 if one is not as expected."""
    logging.disable(logging.CRITICAL)
    word, lines, missed = sys.argv[1] if len(sys.argv) > 1 else "", [], 0
    for fault in [each for each in FAULTS if each.name == word] or [each for each in FAULTS if word in each.name]:
        try:
            found = fault.tried()
        except AssertionError as error:
            found = Found(str(error).splitlines()[0] if str(error) else "failed", False)
        finally:
            dock_all()
        missed += not found.reached
        lines.append(line(fault, found))
        print(lines[-1], flush=True)
    if not word:
        table.written(lines, *TABLE_IN_DOCS)
    print(f"{len(lines) - missed} of {len(lines)} as expected")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
