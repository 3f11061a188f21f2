"""The commands of the boat: live, replay, warm. `live.settings` checks the options of `live`; `launch` runs it."""

import time
from typing import Any

import typer
from typer.core import TyperCommand

from steerway.commands.terminal import argument, option


class LiveCommand(TyperCommand):
    """A command whose option `--helm` may be given without an address."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Insert the default address after a `--helm` without one."""
        from steerway.live.uri import DEFAULT

        words = []
        for k, each in enumerate(args):
            alone = each == "--helm" and (k + 1 == len(args) or args[k + 1].startswith("-"))
            words.append(f"--helm={DEFAULT}" if alone else each)
        return super().parse_args(ctx, words)


def live(
    context: typer.Context,
    config: str | None = argument("[CONFIG.toml]", "Settings file; options override it.", None),
    inputs: list[str] | None = option("ADDRESS", "Where fixes come from.", None, "--from"),
    outputs: list[str] | None = option("ADDRESS", "Where estimates go; stdout: by default.", None, "--to"),
    profile: str | None = option("NAME|FILE.toml", "Filter profile; by default inferred while sailing."),
    learned: str | None = option("FILE.toml", "Save the inferred models to this file; the next run starts from them."),
    source: list[str] | None = option("NAME", "Source of positions; can be repeated, the preferred one first."),
    aid: str | None = option(
        "LIST", "Further measurements to use, any of: auto (default), sog, cog, heading, water-speed, yaw-rate."
    ),
    rate: float | None = option("HZ", "Output rate in Hz; by default one row per fix."),
    mission: str | None = option("FILE", "A route (.toml .gpx .geojson) to steer along."),
    record: str | None = option("FILE.mcap", "Record every input, estimate and order."),
    max_dead_reckoning: float | None = option("S", "Longest prediction without a fix, s; 10 by default."),
    engage: bool | None = option(None, "Start the autopilot as soon as it is ready."),
    from_here: bool | None = option(None, "Start the route even if its first leg is more than 2 km away."),
    latency: float | None = option("S", "Shortest latency of the receiver's fixes, s."),
    lag: float | None = option("S", "Output each fix S seconds late, smoothed with later fixes: for mapping."),
    no_accuracy: bool = option(None, "Ignore the accuracy that the receiver reports.", False, "--no-accuracy"),
    helm: str | None = option("[HOST:PORT]", "Serve the helm page; without an address, at 127.0.0.1:8080."),
    helm_token_file: str | None = option(
        "FILE", "File with the token for other computers; or set STEERWAY_HELM_TOKEN."
    ),
    helm_origin: str | None = option("https://HOST", "Address of the helm page behind a TLS proxy."),
    missions: str | None = option("ADDRESS", "Exchange missions with ground stations, at udpin:127.0.0.1:14560."),
    mavlink_signing: str | None = option("FILE", "Sign MAVLink messages with the passphrase in this file."),
    control: str | None = option("HOST:PORT", "Serve a control port for programs on this computer."),
    control_token_file: str | None = option("FILE", "File with the port's token; or set STEERWAY_CONTROL_TOKEN."),
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
    from steerway.live.settings import Settings

    log_to_stderr("steerway live")
    settings = Settings() if config is None else Settings.load(config)
    given: dict[str, Any] = {name: context.params.get(name) for name in Settings.model_fields}
    given |= {name: tuple(given[name] or ()) or None for name in ("inputs", "outputs", "source")}
    given["aid"] = None if aid is None else tuple(name.strip() for name in aid.split(",") if name.strip())
    given["accuracy"] = False if no_accuracy else None
    launch(settings.overridden(**given))


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
