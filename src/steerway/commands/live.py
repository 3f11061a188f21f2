"""The commands `live` and `warm`: their options; `settings` checks them and `launch` runs them."""

import time
from typing import Annotated, Any

import typer
from typer.core import TyperCommand


class LiveCommand(TyperCommand):
    """A command whose option `--helm` may stand without an address."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Insert the default address after `--helm` where none follows."""
        from steerway.live.helm.address import DEFAULT

        words = []
        for k, each in enumerate(args):
            alone = each == "--helm" and (k + 1 == len(args) or args[k + 1].startswith("-"))
            words.append(f"--helm={DEFAULT}" if alone else each)
        return super().parse_args(ctx, words)


def live(
    config: Annotated[
        str | None, typer.Argument(metavar="[CONFIG.toml]", help="Settings file; options override it.")
    ] = None,
    inputs: Annotated[
        list[str] | None, typer.Option("--from", metavar="ADDRESS", help="Where fixes come from.")
    ] = None,
    outputs: Annotated[
        list[str] | None, typer.Option("--to", metavar="ADDRESS", help="Where estimates go; stdout: by default.")
    ] = None,
    profile: Annotated[
        str | None,
        typer.Option(
            "--profile", metavar="NAME|FILE.toml", help="Filter profile; by default all is inferred while sailing."
        ),
    ] = None,
    learned: Annotated[
        str | None,
        typer.Option("--learned", metavar="FILE.toml", help="Keep what is inferred in a file, and begin from it."),
    ] = None,
    source: Annotated[
        list[str] | None, typer.Option("--source", metavar="NAME", help="Sources of positions in order of priority.")
    ] = None,
    aid: Annotated[
        str | None,
        typer.Option(
            "--aid",
            metavar="LIST",
            help="Further measurements, of: auto (default), sog, cog, heading, water-speed, yaw-rate.",
        ),
    ] = None,
    rate: Annotated[
        float | None, typer.Option("--rate", metavar="HZ", help="Output rate in Hz; by default one row per fix.")
    ] = None,
    mission: Annotated[
        str | None,
        typer.Option("--mission", metavar="FILE", help="A route (.toml .gpx .geojson) to steer along."),
    ] = None,
    record: Annotated[
        str | None,
        typer.Option("--record", metavar="FILE.mcap", help="Record every input, estimate and order."),
    ] = None,
    max_dead_reckoning: Annotated[
        float | None,
        typer.Option(
            "--max-dead-reckoning",
            metavar="S",
            help="Longest time without a fix to predict the motion, s; 10 by default.",
        ),
    ] = None,
    engage: Annotated[
        bool | None, typer.Option("--engage/--no-engage", help="Start the autopilot as soon as it is ready.")
    ] = None,
    from_here: Annotated[
        bool | None,
        typer.Option("--from-here/--no-from-here", help="Begin the route although its first leg is over 2 km away."),
    ] = None,
    latency: Annotated[
        float | None, typer.Option("--latency", metavar="S", help="Least latency of the receiver's fixes, s.")
    ] = None,
    lag: Annotated[
        float | None,
        typer.Option("--lag", metavar="S", help="Give each fix S seconds late, smoothed by the fixes since: for maps."),
    ] = None,
    no_accuracy: Annotated[
        bool, typer.Option("--no-accuracy", help="Ignore the accuracy that the receiver reports.")
    ] = False,
    helm: Annotated[
        str | None,
        typer.Option(
            "--helm", metavar="[HOST:PORT]", help="Serve the helm page; 127.0.0.1:8080 where nothing follows."
        ),
    ] = None,
    helm_token_file: Annotated[
        str | None,
        typer.Option("--helm-token-file", metavar="FILE", help="Token for other computers; or STEERWAY_HELM_TOKEN."),
    ] = None,
    helm_origin: Annotated[
        str | None,
        typer.Option("--helm-origin", metavar="https://HOST", help="Address of the helm page behind a TLS proxy."),
    ] = None,
    missions: Annotated[
        str | None,
        typer.Option(
            "--missions",
            metavar="ADDRESS",
            help="Where ground stations upload and download the mission: udpin:127.0.0.1:14560.",
        ),
    ] = None,
    mavlink_signing: Annotated[
        str | None,
        typer.Option("--mavlink-signing", metavar="FILE", help="Sign MAVLink with the passphrase in a file."),
    ] = None,
    control: Annotated[
        str | None,
        typer.Option("--control", metavar="HOST:PORT", help="Control port for programs on this computer."),
    ] = None,
    control_token_file: Annotated[
        str | None,
        typer.Option("--control-token-file", metavar="FILE", help="Its token; or STEERWAY_CONTROL_TOKEN."),
    ] = None,
) -> None:
    """Estimate and steer on the boat, in real time.

    Inputs: serial:/dev/ttyACM0?baud=38400, tcp://host:port, udp://:port, gpsd://host:2947, signalk://host:3000,
    mavlink:udpin:host:port (udpout, tcp, or mavlink:/dev/…), n2k:can0, n2k+tcp://host:port, file:LOG?speed=10 (or
    speed=max).

    Outputs: stdout: (JSON lines), tcp-server://127.0.0.1:10110, tcp://host:port, udp://host:port, serial:…,
    signalk://host:3000, mavlink:udpin:host:port (steers in GUIDED), n2k:can0, foxglove://127.0.0.1:8765,
    file:RUN.parquet.
    On stdout, serial, tcp, tcp-server and udp ?format= selects nmea, json or propellers.

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
    given = {
        "inputs": inputs and tuple(inputs),
        "outputs": outputs and tuple(outputs),
        "profile": profile,
        "learned": learned,
        "source": source and tuple(source),
        "aid": None if aid is None else tuple(name.strip() for name in aid.split(",") if name.strip()),
        "rate": rate,
        "mission": mission,
        "record": record,
        "max_dead_reckoning": max_dead_reckoning,
        "engage": engage,
        "from_here": from_here,
        "latency": latency,
        "lag": lag,
        "accuracy": False if no_accuracy else None,
        "helm": helm,
        "helm_token_file": helm_token_file,
        "helm_origin": helm_origin,
        "missions": missions,
        "mavlink_signing": mavlink_signing,
        "control": control,
        "control_token_file": control_token_file,
    }
    launch(settings.overridden(**given))


def replay(
    recording: Annotated[str, typer.Argument(metavar="FILE.mcap", help="A recording of `live --record`.")],
    out: Annotated[
        str | None, typer.Option("-o", "--out", metavar="OUT", help="Output file for the estimates.")
    ] = None,
) -> None:
    """Repeat a recorded run and compare its estimates, bit by bit; exit code 1 where they differ by more than 1e-9.

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
        print("recorded by this code" if found.code == code() else f"recorded by other code: {found.code or 'older'}")
    if out is not None:
        write(found.motion(), out)
        print(f"wrote {out}")
    if differing and largest > ANOTHER_PROCESSOR:
        raise typer.Exit(1)


def warm() -> None:
    """Compile what a live run needs, once after installing, so that the boat starts at once.

    Example:

        steerway warm
    """
    from steerway.core.kernel_cache import kernel_cache
    from steerway.live import warming

    begun = time.monotonic()
    warming.warm()
    directory = kernel_cache()
    where = f"kept in {directory}" if directory else "not kept: no directory can be written"
    print(f"compiled in {time.monotonic() - begun:.1f} s, {where}")
