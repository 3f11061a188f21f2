"""The command line: which commands there are, and how the user's mistakes end: in one sentence, with exit code 2."""

import sys

import typer

from steerway.commands import demo, identify, logs, profile, sailing, study
from steerway.core.errors import InputError
from steerway.live.commands import LiveCommand, live, warm

app = typer.Typer(
    name="steerway",
    help="Speed over ground, course over ground and course rate from GNSS positions alone, and steering by them.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
)

for command in (
    logs.estimate,
    logs.info,
    logs.tune,
    logs.compare,
    logs.predict,
    demo.demo,
    sailing.simulate,
    sailing.advise,
    study.study,
):
    app.command()(command)
app.command(cls=LiveCommand)(live)
app.command()(warm)
app.add_typer(identify.app, name="identify")
app.add_typer(profile.app, name="profile")


def main() -> None:
    """Run the command line."""
    try:
        app(standalone_mode=False)
    except InputError as error:
        print(f"steerway: {error}", file=sys.stderr)
        sys.exit(2)
    except typer.Exit as leaving:
        sys.exit(leaving.exit_code)
    except typer.Abort:
        print("steerway: interrupted", file=sys.stderr)
        sys.exit(130)
    except Exception as error:
        if hasattr(error, "format_message"):  # click's own words for a wrong option
            if error.format_message():  # empty where the help has been shown instead
                print(f"steerway: {error.format_message()}", file=sys.stderr)
            sys.exit(2)
        raise
