"""The commands of the program, by topic."""

from importlib.metadata import version
from typing import Annotated, Any

import typer
import typer.core
import typer.main

from steerway.commands import archive, demo, identify, info, logs, plot, profile, sailing, schema, study
from steerway.commands.live import LiveCommand, live, replay, warm

app = typer.Typer(
    name="steerway",
    help="Estimate speed over ground, course over ground and course rate from GNSS positions; steer a boat by them.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

START, LOGS, BOAT, SIMULATION, RESEARCH = "Start here", "Logs", "On the boat", "Simulation", "Research"
for panel, commands in (
    (START, (demo.demo,)),
    (LOGS, (logs.estimate, info.info, logs.compare, logs.predict, logs.tune, plot.plot, archive.encounters)),
    (BOAT, (replay, warm)),
    (SIMULATION, (sailing.simulate, sailing.advise, schema.schema)),
    (RESEARCH, (study.study,)),
):
    for command in commands:
        app.command(rich_help_panel=panel)(command)
app.command(cls=LiveCommand, rich_help_panel=BOAT)(live)
app.add_typer(identify.app, name="identify", rich_help_panel=BOAT)
app.add_typer(archive.app, name="archive", rich_help_panel=LOGS)
app.add_typer(profile.app, name="profile", rich_help_panel=LOGS)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"steerway {version('steerway')}")
        raise typer.Exit


@app.callback()
def options(
    _: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_print_version, help="Print the version.")
    ] = False,
) -> None:
    """Estimate speed over ground, course over ground and course rate from GNSS positions; steer a boat by them."""


def command_tree() -> typer.core.TyperGroup:
    """The tree of commands. Its help shows no types: metavars name the values expected, and flags take none."""
    root: Any = typer.main.get_command(app)  # of a class that typer does not export
    _hide_types(root, typer.Context(root, info_name="steerway", **root.context_settings))
    return root


def _hide_types(command: Any, context: typer.Context) -> None:
    for each in command.get_params(context):
        if isinstance(each, typer.core.TyperArgument):
            each.display_type_rich = lambda ctx: None  # type: ignore[method-assign]
        elif each.is_flag:
            each.metavar = ""
    for name, inner in getattr(command, "commands", {}).items():
        _hide_types(inner, typer.Context(inner, parent=context, info_name=name))
