"""The options that the commands for logs and archives share, and the parsing of their values."""

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from steerway.commands.terminal import argument, flag, option, progress_line
from steerway.core.errors import InputError, printable
from steerway.core.records import AID_COLUMNS

if TYPE_CHECKING:
    from steerway.core.records import Fixes


LOGS = argument("LOG...", "Log files of any supported format, also .gz; - for standard input.")
SOURCE = option("NAME", "Use the positions of this source; `info` lists the sources.", None, "--source")
FROM = option("TIME", "Start of the interval: ISO 8601 (UTC) or Unix s.", None, "--from")
UNTIL = option("TIME", "End of the interval (excluded): ISO 8601 (UTC) or Unix s.", None, "--until")
MAX_SIZE = option("BYTES", "Largest size of a log after decompression, bytes; 1e9 by default.", None, "--max-size")
AS_JSON = flag("--json", "JSON output.")
PROFILE = option("NAME|FILE.toml", "Filter profile; by default inferred from the log.", None, "--profile")
CAUSAL = flag("--causal", "Each row uses only the fixes up to its time, as on board; the default for standard input.")
SMOOTH = flag("--smooth", "Each row uses the whole log (fixed-interval smoothing); the default for files.")
AIDS_OF_LOGS = ("auto", *(name.replace("_", "-") for name in AID_COLUMNS))
AIDS_OF_ARCHIVES = ("sog", "cog", "heading")
_AID = "Further measurements to use, any of: "
AIDS = option("LIST", f"{_AID}{', '.join(AIDS_OF_LOGS)}.", None, "--aid")
ARCHIVE_AIDS = option("LIST", f"{_AID}{', '.join(AIDS_OF_ARCHIVES)}.", None, "--aid")


def expect_toml(path: Path) -> None:
    """Raises InputError unless the path of a profile ends in .toml."""
    if path.suffix != ".toml":
        raise InputError(f"profile {path} ends in {path.suffix or 'nothing'!r}, expected .toml")


def read_logs(
    logs: Sequence[str], source: str | None, start: str | None, stop: str | None, max_size: float | None = None
) -> "Fixes":
    """The fixes in logs, read with a progress bar."""
    from steerway.formats.reading import read

    begin, end = moment("--from", start), moment("--until", stop)
    with progress_line("reading") as step:
        return read(
            *logs,
            source=source,
            start=begin,
            stop=end,
            progress=lambda done, total: step(done / total if total else 0.0),
            max_size=max_size,
        )


def moment(name: str, text: str | None) -> float | None:
    """The Unix time (s) in the text of an option; None for None. Raises InputError that names the option."""
    from steerway.core.timestamps import unix_times

    if text is None:
        return None
    try:
        return float(text)
    except ValueError:
        dated = f"{text}T00:00Z" if re.fullmatch(r"[0-9]{4}-[0-9][0-9]-[0-9][0-9]", text) else text
        moment = float(unix_times([printable(dated)])[0])
    if math.isnan(moment):
        raise InputError(
            f"{name} is {text!r}, expected a time in ISO 8601 such as 2024-09-23T14:26:10Z or in Unix seconds"
        )
    return moment


def aid_names(text: str | None, known: tuple[str, ...] = AIDS_OF_LOGS) -> tuple[str, ...]:
    """The names in the list of --aid, as the library spells them. Raises InputError for an unknown name."""
    names = [name.strip().replace("_", "-") for name in (text or "").split(",") if name.strip()]
    for name in names:
        if name not in known:
            raise InputError(f"--aid names {name!r}, expected any of {', '.join(known)}, separated by commas")
    return tuple(name.replace("-", "_") for name in names)


def asks_smoothed(logs: list[str], causal: bool, smooth: bool) -> bool:
    """Whether to smooth the estimate of these logs: by default for files, only with --smooth for standard input.

    Raises InputError if both options are given.
    """
    if causal and smooth:
        raise InputError("--causal and --smooth are both given, expected one of them")
    return smooth or not (causal or "-" in logs)


def expect_output(out: Path, logs: Iterable[str | Path]) -> None:
    """Raises InputError if an output is one of the inputs or a directory, or if its directory does not exist."""
    from steerway.formats.writing import same_file

    if out.is_dir():
        raise InputError(f"cannot write {str(out)!r}: is a directory")
    if not out.parent.is_dir():
        raise InputError(f"cannot write {str(out)!r}: no directory {str(out.parent)!r}")

    for log in logs:
        if same_file(out, log):
            raise InputError(f"output {out} is also an input, expected another file")
