"""The commands of the boat: live, replay, warm. `live.settings` declares the options of `live`; `launch` runs it."""

import inspect
import time
from typing import Any, get_args

import typer
from typer.core import TyperCommand

from steerway.commands.terminal import argument, option
from steerway.core.settings import Option, description_of, names_of
from steerway.live.settings import Settings
from steerway.live.uri import DEFAULT


class LiveCommand(TyperCommand):
    """A command whose option `--helm` may be given without an address."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Insert the default address after a `--helm` without one."""
        words = []
        for k, each in enumerate(args):
            alone = each == "--helm" and (k + 1 == len(args) or args[k + 1].startswith("-"))
            words.append(f"--helm={DEFAULT}" if alone else each)
        return super().parse_args(ctx, words)


def live(
    config: str | None = argument("[CONFIG.toml]", "Settings file; options override it.", None), **options: Any
) -> None:
    """Estimate and steer on the boat, in real time.

    Inputs: serial:/dev/ttyACM0?baud=38400, tcp://host:port, udp://:port, gpsd://host:2947, signalk://host:3000,
    mavlink:udpin:host:port (udpout, tcp, or mavlink:/dev/…), n2k:can0, n2k+tcp://host:port, file:LOG?speed=10 (or
    speed=max).

    Outputs: stdout: (JSON lines), tcp-server://127.0.0.1:10110, tcp://host:port, udp://host:port, serial:…,
    signalk://host:3000, mavlink:udpin:host:port (steers in GUIDED), n2k:can0, foxglove://127.0.0.1:8765,
    file:RUN.parquet.
    On stdout, serial, tcp, tcp-server and udp, the option ?format= selects nmea, json or propellers.

    Examples:

        steerway live --from serial:/dev/ttyACM0?baud=38400 --to tcp-server://127.0.0.1:10110 --helm

        steerway live boat.toml

        steerway live --from n2k:can0 --to n2k:can0 --mission route.toml --record sortie.mcap

        steerway live --from file:sortie.nmea?speed=max > rows.jsonl
    """
    from steerway.live.build_service import launch
    from steerway.live.process import log_to_stderr

    log_to_stderr("steerway live")
    settings = Settings() if config is None else Settings.load(config)
    given = {name: value for name, value in options.items() if value not in (None, (), [])}
    if options["aid"] is not None:
        given["aid"] = tuple(name.strip() for name in options["aid"].split(",") if name.strip())
    given["accuracy"] = False if options["accuracy"] else None
    launch(settings.overridden(**given))


def _kinds(annotation: Any) -> list[Any]:
    """The types in an annotation."""
    return [annotation, *(inner for each in get_args(annotation) for inner in _kinds(each))]


def _option_of(name: str) -> inspect.Parameter:
    """The option of a field of `Settings`, as a parameter of the command."""
    field = Settings.model_fields[name]
    how = next(each for each in field.metadata if isinstance(each, Option))
    names = [how.name or f"--{names_of(name, field)[0].replace('_', '-')}"]
    kinds = _kinds(field.annotation)
    several = list[str] if field.annotation == tuple[str, ...] else str
    kind: Any = bool if bool in kinds else float if float in kinds else several
    names = [] if kind is bool and not how.name else names  # typer then adds --no-…
    default = option(how.metavar, how.help or description_of(Settings, name), None, *names)
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind | None)


_OPTIONS = [
    name for name, field in Settings.model_fields.items() if any(isinstance(each, Option) for each in field.metadata)
]
_CONFIG, *_ = inspect.signature(live).parameters.values()
live.__signature__ = inspect.Signature([_CONFIG, *map(_option_of, _OPTIONS)])  # type: ignore[attr-defined]


def replay(
    recording: str = argument("FILE.mcap", "A recording of `live --record`."),
    out: str | None = option("OUT", "Output file for the estimates.", None, "-o", "--out"),
) -> None:
    """Repeat a recorded run and compare new and recorded estimates. Exit code 1: they differ by more than 1e-9.

    Example:

        steerway replay sortie.mcap -o sortie.parquet
    """
    from steerway.core.timestamps import iso
    from steerway.formats.writing import write, writer
    from steerway.live.recording import code
    from steerway.live.replaying import ANOTHER_PROCESSOR
    from steerway.live.replaying import replay as repeat

    if out is not None:
        writer(out)
    found = repeat(recording)
    print(f"{found.inputs} inputs, {len(found.recorded)} estimates, {found.orders} orders recorded")
    differing, (largest, column) = found.differing, found.largest
    number = f"{len(differing)} estimates differ"
    if not differing:
        print("every estimate is the same")
    elif largest <= ANOTHER_PROCESSOR:
        print(f"{number} in their last digits, by at most {largest:.1g}, as on another processor")
    else:
        print(f"{number}, the first at {iso(differing[0].time)}, by up to {largest:.3g} in {column}")
        maker = "this version of the code" if found.code == code() else f"another version: {found.code or 'unknown'}"
        print(f"the recording was made by {maker}")
    if out is not None:
        write(found.motion(), out)
        print(f"wrote {out}")
    if differing and largest > ANOTHER_PROCESSOR:
        raise typer.Exit(1)


def warm() -> None:
    """Compile everything that a live run needs, once after the installation, so that live runs start at once.

    Example:

        steerway warm
    """
    from steerway.core.kernel_cache import kernel_cache
    from steerway.live import build_service

    begun = time.monotonic()
    build_service.warm()
    directory = kernel_cache()
    where = f"kept in {directory}" if directory else "not kept: the cache directory cannot be written"
    print(f"compiled in {time.monotonic() - begun:.1f} s, {where}")
