"""Workers and commands end when they should: with their parent, by Ctrl-C, leaving nothing but finished parts."""

import contextlib
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from contextlib import closing
from functools import partial
from pathlib import Path

import pytest

from steerway.core import InputError
from steerway.core.testing import in_workers
from tests.command_line import STEERWAY, run
from tests.faults.commands import of_session
from tests.ports import wait_until

pytestmark = pytest.mark.skipif(not Path("/proc/self").exists(), reason="processes are counted in /proc")
LIMIT = 2.0
SCENARIO = """duration = 100
[route]
at_end = "stop"
waypoints = [{ north = 0, east = 0 }, { north = 2000, east = 0 }]
"""


def started(command, **options) -> subprocess.Popen:
    """A process that heeds signals, also where the tests themselves run under nohup or in the background."""

    def heed():
        for each in (signal.SIGINT, signal.SIGHUP, signal.SIGTERM):
            signal.signal(each, signal.SIG_DFL)

    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, preexec_fn=heed, **options)


def fail_at(bad, item):
    if item == bad:
        raise InputError(f"item {item} is bad")
    return item * item


def killed_at(bad, item):
    if item == bad:
        os.kill(os.getpid(), signal.SIGKILL)
    return item


def shared_objects() -> set[str]:
    return set(os.listdir("/dev/shm"))


def test_results_of_workers_and_exceptions_come_here_and_end_the_others():
    taken = []

    def items():
        for k in range(12):
            taken.append(k)
            yield k

    with closing(in_workers(partial(fail_at, None), items(), 2)) as results:
        first = next(results)
        assert len(taken) <= 4, "an item is taken when a worker is free"
        assert dict([first, *results]) == {k: k * k for k in range(12)}
    for work, error, message in (
        (partial(fail_at, 1), InputError, "item 1 is bad"),
        (partial(killed_at, 2), ChildProcessError, "was ended by signal 9 at item 2"),
    ):
        with pytest.raises(error, match=message) as caught, closing(in_workers(work, range(50), 2)) as results:
            list(results)
        assert error is not InputError or "in fail_at" in "".join(caught.value.__notes__)
        assert multiprocessing.active_children() == []


def entries(path) -> list:
    """Keys of what is kept; the last line may be half written."""
    keys = []
    with contextlib.suppress(ValueError):
        for line in path.read_bytes().splitlines()[1:]:
            keys.append(json.loads(line[9:])["tuple"][0])  # behind a checksum
    return keys


@contextlib.contextmanager
def campaign_underway(out, *options):
    """`simulate --seeds` in a process group of its own, as a terminal would start it, when some seeds are done."""
    scenario = out / "leg.toml"
    scenario.write_text(SCENARIO)
    command = [*STEERWAY, "simulate", str(scenario), "-o", str(out), "--seeds", "400", *options]
    process = started(command, stdout=subprocess.PIPE, start_new_session=True)
    kept = out / "campaign.unfinished"
    wait_until(lambda: kept.exists() and len(entries(kept)) > 2, 100.0)
    try:
        yield process
    finally:
        process.kill()


def test_ctrl_c_keeps_the_seeds_that_are_done_and_resume_continues(tmp_path):
    before = shared_objects()
    with campaign_underway(tmp_path) as process:
        os.killpg(process.pid, signal.SIGINT)  # as a terminal sends it: to the command and its workers
        began = time.monotonic()
        _, output = process.communicate(timeout=LIMIT)
        assert process.returncode == 130
        assert output.startswith("steerway: interrupted, ") and output.endswith("--resume continues\n")
        assert output.count("\n") == 1
        wait_until(lambda: not of_session(process.pid), LIMIT - (time.monotonic() - began))
    assert shared_objects() <= before
    seeds = entries(tmp_path / "campaign.unfinished")
    assert len(seeds) == len(set(seeds)) > 2

    # The rest is done, no seed twice, and the numbers are those of a campaign that nobody interrupted.
    campaign = ("simulate", tmp_path / "leg.toml", "--seeds", 2, "--first-seed", seeds[0])
    code, _, output = run(*campaign, "-o", tmp_path, "--resume")
    assert code in (0, None) and output.startswith("resumed: ")
    assert not (tmp_path / "campaign.unfinished").exists()
    assert run(*campaign, "-o", tmp_path / "whole")[0] in (0, None)
    assert (tmp_path / "results.json").read_text() == (tmp_path / "whole" / "results.json").read_text()


def test_resume_needs_a_campaign_and_its_own_scenario(tmp_path):
    (tmp_path / "campaign.unfinished").write_text('{"scenario": "another"}\n')
    (tmp_path / "leg.toml").write_text(SCENARIO)
    code, _, output = run("simulate", tmp_path / "leg.toml", "-o", tmp_path, "--seeds", 2, "--resume")
    assert code == 2 and "is from other work or another version" in output
    _, _, output = run("simulate", tmp_path / "leg.toml", "-o", tmp_path, "--resume")
    assert output == "steerway: --resume continues a campaign, expected --seeds N with it\n"


COMPILED = """
import sys, time
from steerway.commands.testing import app, cli
@app.command()
def stuck():
    import hashlib
    print("begun", flush=True)
    hashlib.pbkdf2_hmac("sha256", b"", b"", 10**9)  # as compiled code: no return to the interpreter
sys.argv = ["steerway", "stuck"]
cli.main()
"""


def test_a_command_in_compiled_code_ends_with_one_line():
    process = started([sys.executable, "-c", COMPILED], stdout=subprocess.PIPE)
    assert process.stdout.readline() == "begun\n"
    for _ in range(3):  # an impatient user
        process.send_signal(signal.SIGTERM)
    _, output = process.communicate(timeout=LIMIT)
    assert (process.returncode, output) == (143, "steerway: terminated\n")
