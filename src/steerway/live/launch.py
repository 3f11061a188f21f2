"""From settings to a running service."""

import gc
import math

from steerway.core.errors import InputError
from steerway.estimation.profiles import Profile
from steerway.live import addresses
from steerway.live.autopilot.mission import GeodeticRoute
from steerway.live.autopilot.route import Guide
from steerway.live.autopilot.states import Autopilot
from steerway.live.helm.address import address, token_of
from steerway.live.helm.bridge import Helm
from steerway.live.navigator import Navigator
from steerway.live.outputs.propellers import Propellers
from steerway.live.process import until_stopped
from steerway.live.service import RATE, Service
from steerway.live.settings import Settings

SLOWEST_STEERING = 5.0
"""Hz at which an autopilot still has its hand on the helm."""
_COLLECTIONS = 200, 5, 20
"""Little and often: new objects, and collections of the younger generation, from one of a generation to the next."""


def launch(settings: Settings) -> None:
    """Run to the end of the logs, or until told to stop. Raises InputError for what cannot be run."""
    if settings.engage and settings.mission is None:
        raise InputError("--engage has nothing to follow, expected --mission with a route")
    if settings.mission is not None and settings.rate is not None and settings.rate < SLOWEST_STEERING:
        raise InputError(f"--rate is {settings.rate:g} Hz, expected at least {SLOWEST_STEERING:g} Hz with --mission")
    found, speed = addresses.sources(settings.listen_to)
    page = None if settings.helm is None else address(settings.helm, token_of(settings.helm_token_file))
    replayed, rate = not math.isnan(speed), settings.rate
    profile = settings.profile
    tuning = Profile.load(profile) if profile.endswith(".toml") else Profile.named(profile)
    aids = tuple(name.replace("-", "_") for name in settings.aid)
    navigator = Navigator(tuning, aids, settings.source, settings.patience, rate=rate, accuracy=settings.accuracy)
    route = None if settings.mission is None else GeodeticRoute.load(settings.mission)
    guide = None if route is None else Guide(route)
    autopilot = None if route is None else Autopilot(route, tuning, settings.patience, settings.engage)
    ears = [] if replayed else [addresses.listener(each, len(found)) for each in found]
    pairs = [addresses.output(text, rate, replayed, ears, autopilot) for text in settings.say_to]
    if route is None and any(isinstance(each, Propellers) for each, _ in pairs):
        raise InputError("say=propellers has nothing to follow, expected --mission with a route")
    speakers = [speaker for _, speaker in pairs if speaker is not None]
    service = Service(navigator, [each for each, _ in pairs], rate or RATE, settings.latency, guide, autopilot)
    if page is not None:
        speakers.append(Helm(service, page, route))
    if replayed:
        rows = _rows_of_logs([each.path for each in found])
        until_stopped(service.replay(rows, speed, speakers))
        wanted = ", ".join(settings.source)
        if not navigator.counts["taken"] and wanted:
            raise InputError(f"source {wanted!r} has no position in {', '.join(each.path for each in found)}")
    else:
        _made_ready()
        until_stopped(service.listen(ears, speakers))


def _rows_of_logs(paths):
    """The rows of all logs in time order. Raises InputError as `read` does."""
    from steerway.formats.reading import survey
    from steerway.formats.sources import gather
    from steerway.live.heard import rows_of

    logs = survey(*paths)
    return list(rows_of(gather([(log.name, log.recording.sources) for log in logs])))


def _made_ready():
    """Load what is compiled, and keep the garbage collector short: a full collection takes 70 ms, an early one 1 ms."""
    from steerway.live import warming

    warming.warm()
    gc.collect()
    gc.freeze()
    gc.set_threshold(*_COLLECTIONS)
