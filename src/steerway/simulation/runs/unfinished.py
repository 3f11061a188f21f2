"""The seeds of a campaign that are done, kept on the disk until all are."""

import hashlib
import json
from importlib.metadata import version
from pathlib import Path

from steerway.core.errors import InputError
from steerway.core.files import cannot_write, made_directory
from steerway.simulation.scenario import Scenario

NAME = "campaign.unfinished"


class UnfinishedCampaign:
    """Numbers by seed, each appended to a file as soon as it is known.

    With `resume` the seeds of an interrupted campaign are read back; without, the file is begun anew. Raises InputError
    for a directory that cannot be written, and for the seeds of another scenario or another version.
    """

    def __init__(self, directory: Path, scenario: Scenario, resume: bool = False):
        self.numbers: dict[int, dict[str, float]] = {}
        self._path = Path(directory) / NAME
        without_seed = scenario.model_dump_json(exclude={"seed"})
        self._origin = {"scenario": hashlib.sha256(without_seed.encode()).hexdigest(), "version": version("steerway")}
        made_directory(directory)
        try:
            lines = [json.dumps(self._origin), *(self._read() if resume and self._path.exists() else ())]
            self._path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
            self._file = open(self._path, "a", encoding="utf-8")
        except OSError as error:
            raise cannot_write(self._path, error) from None

    def add(self, seed: int, numbers: dict[str, float]) -> None:
        """Keep one seed. Raises InputError on a full disk."""
        self.numbers[seed] = numbers
        try:
            self._file.write(json.dumps({"seed": seed, "numbers": numbers}) + "\n")
            self._file.flush()
        except OSError as error:
            raise cannot_write(self._path, error) from None

    def remove(self) -> None:
        """Everything is in the campaign's own files."""
        self._file.close()
        self._path.unlink(missing_ok=True)

    def _read(self):
        """The whole lines of the seeds, which are put into `numbers`; the last may have been cut off."""
        first, *rest = self._path.read_text(encoding="utf-8").splitlines() or [""]
        if _parsed(first) != self._origin:
            raise InputError(
                f"{self._path} is of another scenario or version, expected the scenario of the interrupted campaign "
                "(or no --resume)"
            )
        lines = []
        for line in rest:
            if (entry := _parsed(line)) is not None:
                self.numbers[entry["seed"]] = entry["numbers"]
                lines.append(line)
        return lines


def _parsed(line):
    try:
        return json.loads(line)
    except ValueError:
        return None
