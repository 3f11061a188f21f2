"""The commands of the simulation: simulate, advise."""

import contextlib
import hashlib
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from steerway.commands import interruption
from steerway.commands.terminal import argument, flag, option, print_table, progress_line
from steerway.core.errors import InputError
from steerway.core.locks import only_writer

if TYPE_CHECKING:
    from steerway.simulation.scenario import Scenario


_FASTEST = 1000.0  # m/s


def simulate(
    scenario: Path = argument("SCENARIO.toml", "Scenario file."),
    out: Path | None = option("DIR", "Output directory for the run and its page.", None, "-o", "--out"),
    seeds: int | None = option("N", "Monte Carlo: simulate N seeds on all cores.", min=1),
    first_seed: int | None = option("K", "First seed, in place of the scenario's.", min=0),
    dask: str | None = option("ADDRESS", "Simulate the seeds on this Dask cluster (host:port)."),
    resume: bool = flag("--resume", "With --seeds: continue an interrupted campaign; finished seeds are kept."),
    nmea: bool = flag("--nmea", "Also write the receiver's log, as input for `estimate`."),
    manoeuvre: str | None = option(
        "KIND:DEGREES", "Run a manoeuvre in place of route and orders: zigzag:10/10, turning-circle:35 or pull-out:20."
    ),
    strict: bool = flag("--strict", "Exit with an error if the autopilot is too fast for the course estimate."),
    live: bool = flag("--live", "Run in real time and send measurements over links."),
    to: list[str] | None = option("ADDRESS", "With --live: where the receiver's sentences go; can be repeated."),
    mavlink: str | None = option("ADDRESS", "With --live: act as a MAVLink vehicle at this address."),
    propellers: str | None = option("ADDRESS", "With --live: receive propeller commands at this address."),
    speed: float = option("FACTOR", "With --live: run this many times faster than real time.", 1.0),
) -> None:
    """Simulate a scenario: vessel, environment, instruments, estimator, guidance and control in a closed loop.

    Writes run.parquet (truth, measurements, estimate, commands) and index.html; with --seeds one row per seed.

    With --live the scenario's pilot, route and duration are not used. The boat runs in real time until you stop it. It
    circles until it receives commands: MAVLink commands in GUIDED mode, as for ArduPilot's Rover, or propeller
    commands. The receiver sends GGA and RMC to tcp-server://127.0.0.1:10110, tcp://host:port, udp://host:port,
    serial:… or stdout:. MAVLink addresses: udpout:host:port, udpin:host:port, tcp:host:port or a serial port, with
    ?cruise=2 for the speed in m/s at full thrust. With -o, run.parquet contains the true motion at every fix.

    Examples:

        steerway simulate examples/otter-mission.toml -o sailed --nmea

        steerway simulate examples/otter-mission.toml -o many --seeds 1000

        steerway simulate examples/p1.toml -o zigzag --manoeuvre zigzag:10/10

        steerway simulate examples/mariner-route.toml -o many --seeds 1000 --dask 10.0.0.1:8786

        steerway simulate examples/otter-square.toml --live --to udp://127.0.0.1:10110

        steerway simulate examples/otter-square.toml --live --mavlink udpout:127.0.0.1:14550
    """
    from steerway.simulation import advising, run
    from steerway.simulation.reading import load_scenario
    from steerway.simulation.runs.files import write
    from steerway.simulation.runs.page import COMPARED, comparison, summary

    if seeds is None and dask is not None:
        raise InputError("--dask distributes seeds over a cluster, expected --seeds N with it")
    if seeds is None and resume:
        raise InputError("--resume continues a campaign, expected --seeds N with it")
    if seeds is not None and nmea:
        raise InputError("--nmea writes the log of one run, expected no --seeds with it")
    chosen = load_scenario(scenario, {"seed": first_seed, "manoeuvre": manoeuvre})
    if live:
        _refuse_with_live(seeds=seeds, nmea=nmea, strict=strict, manoeuvre=manoeuvre)
        from steerway.live.simulated.running import sail_live

        with contextlib.nullcontext() if out is None else only_writer(out, str(out)):
            sail_live(chosen, to or (), mavlink, propellers, speed, out)
        return
    if to or mavlink or propellers:
        raise InputError("--to, --mavlink and --propellers are links of a real-time run, expected --live with them")
    if out is None:
        raise InputError("-o is missing, expected an output directory")
    sentence = _warned(*advising.advise(chosen), strict)
    with only_writer(out, str(out)):
        if seeds is not None:
            _campaign(chosen, seeds, dask, out, resume, sentence)
            return
        with progress_line(f"simulating {chosen.name}") as step:
            sailed = run.sail_scenario(chosen, progress=step)
        written = write(sailed, out, nmea, [sentence])
    print_table(f"{chosen.name}: estimated against true", COMPARED, comparison(sailed.numbers))
    print_table("summary", ("", ""), summary(sailed.numbers))
    for path in written:
        print(f"wrote {path}")


def _refuse_with_live(**options: object) -> None:
    for name, value in options.items():
        if value:
            raise InputError(f"--{name} cannot be combined with --live")


def _campaign(scenario: "Scenario", n: int, dask: str | None, out: Path, resume: bool, sentence: str) -> None:
    from steerway.simulation.run import numbers_of_seed, over_seeds
    from steerway.simulation.runs.campaign import SPREAD_COLUMNS, spread, write_campaign
    from steerway.simulation.unfinished import Unfinished

    seeds = range(scenario.seed, scenario.seed + n)
    without_seed = scenario.model_dump_json(exclude={"seed"})
    origin = {"scenario": hashlib.sha256(without_seed.encode()).hexdigest()}
    kept = Unfinished(out / "campaign.unfinished", origin, resume)
    kept.noted = lambda: interruption.keep(f"{len(kept.results)} of {n} seeds", out)
    missing = [seed for seed in seeds if seed not in kept.results]
    before = 1.0 - len(missing) / n
    if before:
        print(f"resumed: {n - len(missing)} of {n} seeds are done", file=sys.stderr)

    with progress_line(f"simulating {n} seeds of {scenario.name}") as step:
        progress = lambda part: step(before + (1.0 - before) * part)  # noqa: E731
        over_seeds(partial(numbers_of_seed, scenario), missing, progress=progress, dask=dask, finished=kept.add)
    results = [kept.results[seed] for seed in seeds]
    written = write_campaign(seeds, results, out, f"{scenario.name}, {n} seeds", [sentence])
    kept.remove()
    print_table(f"{scenario.name}, {n} seeds", SPREAD_COLUMNS, spread(results))
    for path in written:
        print(f"wrote {path}")


def advise(
    profile: str = argument("PROFILE|SCENARIO.toml", "A built-in profile or a file."),
    bandwidth: float | None = option(
        "RAD/S", "Bandwidth of the autopilot, rad/s; without it, the largest that fits is printed."
    ),
    speed: float | None = option("M/S", "Lowest speed over ground, m/s."),
    rate: float = option("HZ", "Rate of the fixes, Hz.", 5.0),
    position_std: float | None = option("M", "Standard deviation of a fix per axis, m; by default the profile's."),
    nomoto_time: float | None = option(
        "S", "Nomoto time constant T, s; if given, the damping of the closed loop is checked too."
    ),
    strict: bool = flag("--strict", "Exit with an error if the autopilot is too fast."),
) -> None:
    """Check that an autopilot is not too fast for the course estimate.

    A course estimated from positions lags. The lag grows with the position errors, and as the speed falls. If the
    autopilot's bandwidth exceeds the estimate's, the course oscillates. PROFILE is a filter profile or a scenario. In
    a scenario that steers by the estimated current, the current and the widest turn are checked too.

    Examples:

        steerway advise otter --speed 1.2 --bandwidth 0.5 --nomoto-time 1

        steerway advise examples/otter-mission.toml --strict
    """
    from steerway.control.bandwidth import advice, carried_bandwidth
    from steerway.estimation.vessel.profile import profile_of
    from steerway.simulation import advising
    from steerway.simulation.reading import load_scenario

    if _is_scenario(profile):
        print(_warned(*advising.advise(load_scenario(profile)), strict, quiet=True))
        return
    tuning = profile_of(profile)
    if speed is None:
        raise InputError("--speed is missing, expected the lowest speed over ground in m/s")
    if speed > _FASTEST:
        raise InputError(f"--speed is {speed:g}, expected at most {_FASTEST:g} m/s")
    if not rate > 0.0:
        raise InputError(f"--rate is {rate:g} Hz, expected a number above 0")
    std = tuning.position_std if position_std is None else position_std
    circumstances = (speed, tuning.agility, std, 1.0 / rate)
    if bandwidth is None:
        carried = carried_bandwidth(*circumstances)
        fitting = "" if nomoto_time is None else f"; {_damped(carried, nomoto_time)}"
        print(
            f"The bandwidth of the course estimate is {carried:.2g} rad/s at {speed:g} m/s with fixes of {std:g} m "
            f"every {1.0 / rate:g} s{fitting}."
        )
        return
    print(_warned(*advice(bandwidth, *circumstances, nomoto_time), strict, quiet=True))


def _damped(carried: float, nomoto_time: float) -> str:
    """The largest autopilot bandwidth with a well-damped loop, in words; `carried`: that of the estimate, rad/s."""
    import numpy as np

    from steerway.control.bandwidth import COMFORTABLE, loop_damping

    least = 1.0 / (2.0 * nomoto_time)
    tried = np.geomspace(least, max(carried, least), 60)
    damped = [each for each in tried if loop_damping(each, carried, nomoto_time) > COMFORTABLE] if carried > 0.0 else []
    if not damped:
        return f"no autopilot of a boat with T = {nomoto_time:g} s is well damped with this estimate"
    return f"autopilots up to {damped[-1]:.2g} rad/s are well damped with this estimate"


def _is_scenario(path: str) -> bool:
    """Whether a file is a scenario: it has a route or orders."""
    from steerway.core.settings import read_toml

    return path.endswith(".toml") and not {"route", "orders"}.isdisjoint(read_toml(path, "file"))


def _warned(fits: bool, sentence: str, strict: bool, quiet: bool = False) -> str:
    """The sentence. If not `fits`, it is also a warning on stderr (unless `quiet`) or, with `strict`, an InputError."""
    if not fits and strict:
        raise InputError(f"{sentence[0].lower()}{sentence[1:-1]} (refused by --strict)")
    if not fits and not quiet:
        print(f"warning: {sentence}", file=sys.stderr)
    return sentence
