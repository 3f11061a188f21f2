"""The commands for profiles: list, show, make."""

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from steerway.commands.options import AS_JSON, FROM, LOGS, SOURCE, UNTIL, expect_output, expect_toml, read_logs
from steerway.commands.terminal import argument, flag, option, print_json, print_pairs, progress_line

if TYPE_CHECKING:
    pass


app = typer.Typer(
    no_args_is_help=True,
    help="List, show and make profiles: the parameters of the filter for a vessel and its receiver.",
)


@app.command("list")
def list_profiles(as_json: bool = AS_JSON) -> None:
    """List the built-in profiles.

    Example:

        steerway profile list
    """
    from steerway.estimation.vessel.profile import BUILT_IN

    if as_json:
        print_json([each.model_dump() for each in BUILT_IN.values()])
    else:
        print_pairs([(each.name, each.description) for each in BUILT_IN.values()])


@app.command("show")
def show_profile(
    name: str = argument("NAME|FILE.toml", "A built-in profile or a file."),
    as_json: bool = AS_JSON,
) -> None:
    """Print a profile as TOML, to edit and save.

    A tuned profile contains a 95 % interval for every parameter and lists those that the log does not determine.

    Example:

        steerway profile show small-usv > mine.toml
    """
    from steerway.estimation.vessel.profile import profile_of

    profile = profile_of(name)
    if as_json:
        print_json(profile.model_dump(mode="json"))
    else:
        print(profile.toml(), end="")


@app.command("make")
def make_profile(
    logs: list[str] = LOGS,
    out: Path = option("PROFILE.toml", "Output file for the profile.", ..., "-o", "--out"),
    tuned: bool = flag("--tune/--quick", "Fit the profile as `tune` does, or infer it as `estimate` does.", True),
    source: str | None = SOURCE,
    start: str | None = FROM,
    stop: str | None = UNTIL,
) -> None:
    """Make a profile of a vessel and its receiver from logs, with a 95 % interval for every parameter.

    Examples:

        steerway profile make sortie.nmea -o mine.toml

        steerway profile make sortie.nmea --quick -o mine.toml
    """
    from steerway.estimation import choose_profile
    from steerway.estimation import tune as fit
    from steerway.estimation.fit.description import structures_of

    expect_output(out, logs)
    expect_toml(out)
    fixes = read_logs(logs, source, start, stop)
    if tuned:
        with progress_line("fitting") as step:
            found = fit(fixes, name=out.stem, progress=step)
        profile = found.profile
        print_pairs(found.sentences())
    else:
        profile = choose_profile(fixes).model_copy(update={"name": out.stem})
        if profile.structures:
            print_pairs([(f"weight {each['weight']:.2f}", each["words"]) for each in structures_of(profile)])
        else:
            print_pairs([("built in", profile.description)])
    profile.save(out)
    print(f"wrote {out}")
