"""The commands of the program, by topic."""

from importlib.metadata import version
from typing import Annotated

import typer

from steerway.commands import demo, identify, logs, profile, sailing, study
from steerway.live.commands import LiveCommand, live, warm

app = typer.Typer(
    name="steerway",
    help="Speed over ground, course over ground and course rate from GNSS positions alone, and steering by them.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

LOGS, BOAT, SIMULATION, RESEARCH = "Logs", "On the boat", "Simulation", "Research"
for panel, commands in (
    (LOGS, (logs.estimate, logs.info, logs.compare, logs.predict, logs.tune)),
    (SIMULATION, (demo.demo, sailing.simulate, sailing.advise)),
    (RESEARCH, (study.study,)),
):
    for command in commands:
        app.command(rich_help_panel=panel)(command)
app.command(cls=LiveCommand, rich_help_panel=BOAT)(live)
app.command(rich_help_panel=BOAT)(warm)
app.add_typer(identify.app, name="identify", rich_help_panel=BOAT)
app.add_typer(profile.app, name="profile", rich_help_panel=LOGS)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"steerway {version('steerway')}")
        raise typer.Exit


@app.callback()
def options(
    _: Annotated[bool, typer.Option("--version", metavar="", is_eager=True, callback=_print_version)] = False,
) -> None:
    """Speed over ground, course over ground and course rate from GNSS positions alone, and steering by them."""
