"""Builds a service from its settings and runs it."""

import asyncio
import gc
import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from steerway.core.errors import InputError
from steerway.core.estimate import NOTHING_KNOWN
from steerway.core.leg import LegState
from steerway.core.records import Fixes
from steerway.estimation.estimator_tables import EstimatorSettings
from steerway.estimation.learning import LearningFilter
from steerway.estimation.vessel.profile import Profile, profile_of
from steerway.formats.nmea0183.writing import gga, rmc
from steerway.live import addresses
from steerway.live.addresses import Context
from steerway.live.autopilot.mission import GeodeticRoute
from steerway.live.autopilot.piloting import PROPELLERS, YAW_RATE
from steerway.live.autopilot.supervisor import Supervisor
from steerway.live.control_port import ControlPort, control_address
from steerway.live.helm.page_process import HelmPage
from steerway.live.learning import RecordedLearning
from steerway.live.links.decoding import ReceiverDecoder
from steerway.live.links.link import Input, Runs, Sink
from steerway.live.mavlink.missions import MissionLink
from steerway.live.navigator import Navigator
from steerway.live.outputs.lines import JsonLines, SentenceOutput
from steerway.live.outputs.signalk_output import Deltas
from steerway.live.process import until_stopped
from steerway.live.rows import InputRow
from steerway.live.service import LOG, RATE, Service
from steerway.live.settings import Settings
from steerway.live.uri import address, token_of
from steerway.pilot import DEFAULT_KINDS, Pilot

if TYPE_CHECKING:
    from steerway.live.recording import Recorder

SLOWEST_STEERING = 5.0
"""Lowest tick rate with an autopilot, Hz."""
_RECORDED = {"max_dead_reckoning", "rate", "accuracy", "lag", "latency"}
_COLLECTIONS = 200, 5, 20
"""Thresholds of the garbage collector: small collections often, so that each is short."""
_WARM_SECONDS = 30
_WARM_RATE = 5.0
"""Tick rate for compilation, Hz: the lowest that runs every code path."""
_WARM_STEP = 3e-7  # step to the north each second, rad


class _NullSink(Sink):
    """A sink that drops everything."""

    def send(self, message: bytes) -> None:
        pass


def warm(kinds: tuple[str, str] = DEFAULT_KINDS, estimators: EstimatorSettings = EstimatorSettings()) -> int:  # noqa: B008
    """Compile all code of a live run by running a short track through it; return the number of fixes used.

    kinds, estimators: autopilot, speed controller and estimators that will run.
    """
    decoder, navigator = ReceiverDecoder(), Navigator(LearningFilter(background=False))
    place, rows = (math.radians(54.0), math.radians(10.0)), []
    for k in range(_WARM_SECONDS):
        moment = 1.7e9 + k, place[0] + _WARM_STEP * k, place[1]
        rows += decoder.feed((gga(*moment) + rmc(*moment)).encode())
    route = GeodeticRoute(place[0] + _WARM_STEP * np.array([0.0, 15.0, 1000.0]), np.full(3, place[1]))
    supervisor = Supervisor(route, engage=True, kinds=kinds, estimators=estimators)
    outputs = [SentenceOutput(_NullSink(None)), Deltas(_NullSink(None)), JsonLines(_NullSink(None))]
    was_disabled, LOG.disabled = LOG.disabled, True
    try:
        asyncio.run(
            Service(navigator, outputs, _WARM_RATE, supervisor=supervisor).replay(rows + decoder.complete_on_silence())
        )
    finally:
        LOG.disabled = was_disabled
    _infer()
    _turn(supervisor.pilot)
    for k in range(_WARM_SECONDS):  # rows with velocity and heading run further code
        later = rows[-1].time + 1.0 + k
        supervisor.estimator.filter.fix(later, 2.0 * k, 0.0, 2.0, 0.0, 0.0)
        supervisor.take(InputRow("", later, sog=2.0, cog=0.0, heading=0.0, bottom_speed=2.0, acceleration=0.0))
    return navigator.counts["used"]


def _infer() -> None:
    """Compile the kernels of an inference by running one on a few generated fixes."""
    from steerway.estimation.log.run import infer_log

    chance = np.random.default_rng(0)
    latitude = math.radians(54.0) + _WARM_STEP * np.arange(12.0) + chance.normal(0.0, 1e-8, 12)
    infer_log(Fixes(1.7e9 + np.arange(12.0), latitude, np.full(12, math.radians(10.0))))


def _turn(pilot: Pilot) -> None:
    """Compile the kernels of a turn by planning one near its waypoint, and by following its path."""
    steering, speed = pilot.in_current, 2.0
    if steering is None:
        return
    known = NOTHING_KNOWN._replace(north=0.0, east=0.0, sog=speed, cog=0.0, cog_std=0.1, heading=0.0, yaw_rate=0.0)
    known = known._replace(heading_std=0.1, water_speed=speed, current_north=0.0, current_east=0.0, speed_gain=1.0)
    leg = LegState(10, 0.0, 0.0, 0.0, speed, speed, 0.0, speed)
    steering.turn(leg, 1.0, known, pilot.autopilot.model)
    steering.watch(leg._replace(target=11, direction=1.0), known, 0.1)
    steering.with_shorter_lookahead(leg, speed, known)


def launch(settings: Settings) -> None:
    """Run to the end of the logs, or until stopped. Raises InputError for settings that cannot be run."""
    _check(settings)
    signing = settings.mavlink_signing
    found, speed = addresses.sources([addresses.signed(each, signing) for each in settings.inputs])
    helm = settings.helm
    page = None if helm is None else address(helm, token_of(settings.helm_token_file), settings.helm_origin)
    control = None if settings.control is None else control_address(settings.control, settings.control_token_file)
    replayed, rate = not math.isnan(speed), settings.rate
    aids = tuple(str(name).replace("-", "_") for name in settings.aid)
    longest = settings.max_dead_reckoning
    tuning = _tuning(settings, aids, replayed)
    accuracy, lag = settings.accuracy, settings.lag
    navigator = Navigator(tuning, aids, settings.source, longest, rate=rate, accuracy=accuracy, lag=lag)
    to = [addresses.sink(addresses.signed(each, signing)) for each in settings.outputs]
    takes = PROPELLERS if any(map(addresses.commands_propellers, to)) else YAW_RATE
    route = supervisor = None
    kinds = settings.autopilot.kind, settings.speed.controller
    if settings.mission is not None:
        route = GeodeticRoute.load(settings.mission)
        of_pilot = tuning.learned if isinstance(tuning, LearningFilter) else tuning
        supervisor = Supervisor(
            route,
            of_pilot,
            longest,
            settings.engage,
            takes,
            kinds,
            settings.estimator,
            settings.from_here,
        )
    elif takes == PROPELLERS:
        raise InputError("format=propellers needs a route, expected --mission FILE with it")
    inputs = [] if replayed else [addresses.opened(each, len(found)) for each in found]
    context = Context(rate is not None, replayed, inputs, supervisor)
    pairs = [addresses.output(each, context) for each in to]
    links: list[Runs] = [link for _, link in pairs if link is not None]
    outputs = [each for each, _ in pairs]
    recorder = None if settings.record is None else _recorder(settings.record, settings, tuning, aids, inputs)
    if recorder is not None:
        outputs.append(recorder)
    service = Service(navigator, outputs, rate or RATE, settings.latency, supervisor, recorder)
    if control is not None:
        links.append(ControlPort(service.controls, control))
    if settings.missions is not None and supervisor is not None:
        links.append(MissionLink(addresses.ground_station(settings.missions, signing), supervisor, service.controls))
    if page is not None:
        links.append(HelmPage(service, page, route))
    if replayed:
        rows = _rows_of_logs([each.path for each in found], settings.source)
        until_stopped(service.replay(rows, speed, links))
    else:
        _made_ready(kinds, settings.estimator)
        until_stopped(service.run(inputs, links))


def _check(settings: Settings) -> None:
    """Raises InputError for settings that exclude one another."""
    if settings.engage and settings.mission is None:
        raise InputError("--engage needs a route, expected --mission FILE with it")
    if settings.missions is not None and settings.mission is None:
        raise InputError("--missions lets ground stations change the route, expected --mission FILE with it")
    steering = settings.autopilot, settings.speed, settings.estimator
    if settings.mission is None and any(table.model_fields_set for table in steering):
        raise InputError("settings: autopilot, speed and estimator are only used with a route, expected mission too")
    if settings.mission is not None and settings.rate is not None and settings.rate < SLOWEST_STEERING:
        raise InputError(f"--rate is {settings.rate:g} Hz, expected at least {SLOWEST_STEERING:g} Hz with --mission")
    if settings.lag and (settings.mission is not None or settings.rate is not None):
        raise InputError("--lag delays the row of every fix, expected neither --mission nor --rate with it")


def _tuning(settings: Settings, aids: tuple[str, ...], replayed: bool) -> Profile | RecordedLearning:
    """The given profile; else a filter that learns a profile, and starts with the profile stored by the last run."""
    if settings.profile is not None:
        return profile_of(settings.profile)
    start, keep = None, None
    if settings.learned is not None:
        path = Path(settings.learned)
        start, keep = Profile.load(path) if path.exists() else None, lambda profile: profile.save(path)
    return RecordedLearning(start, aids, not replayed, keep)


def _recorder(
    path: str,
    settings: Settings,
    tuning: Profile | RecordedLearning,
    aids: tuple[str, ...],
    inputs: Sequence[object],
) -> "Recorder":
    """The recorder of a run, connected to the bytes of its links. Raises InputError if it cannot write its file."""
    from steerway.live.recording import Recorder

    if any(_is_input(path, each) for each in settings.inputs):
        raise InputError(f"record {path} is also an input, expected another file")
    start = tuning.learned if isinstance(tuning, RecordedLearning) else tuning
    needed = {
        "profile": None if start is None else start.toml(),
        "learns": isinstance(tuning, RecordedLearning),
        "aid": aids,
        "sources": settings.source,
        **settings.model_dump(include=_RECORDED),
    }
    recorder = Recorder(path, needed)
    if isinstance(tuning, RecordedLearning):
        tuning.note = recorder.learning
    for each in inputs:
        if isinstance(each, Input):
            each.tap = partial(recorder.raw, each.uri.text)
    return recorder


def _is_input(path: str, address: str) -> bool:
    from steerway.formats.writing import same_file

    return address.startswith("file:") and same_file(path, address.removeprefix("file:").partition("?")[0])


def _rows_of_logs(paths: Sequence[str], wanted: Sequence[str]) -> list[InputRow]:
    """The rows of all logs in time order: from the source that `estimate` chooses, or from all if several are wanted.

    Raises InputError as `read` does.
    """
    from steerway.formats.reading import read, survey
    from steerway.formats.sources import choose, gather
    from steerway.live.rows import rows_of

    if len(wanted) <= 1:
        fixes = read(*paths, source=next(iter(wanted), None))
        return list(rows_of({fixes.source: fixes}))
    sources = gather([(Path(log.name).name, log.recording.sources) for log in survey(*paths)])
    for each in wanted:
        choose(sources, each)
    return list(rows_of(sources))


def _made_ready(kinds: tuple[str, str], estimators: EstimatorSettings) -> None:
    """Load compiled code, and collect garbage often: a full collection takes 70 ms, an early one 1 ms."""
    warm(kinds, estimators)
    gc.collect()
    gc.freeze()
    gc.set_threshold(*_COLLECTIONS)
