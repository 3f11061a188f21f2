"""The licence of every dependency of the lock files, from the packages as installed, is one that the project's allows.

The package itself is MIT; what it requires has to be permissive, optional extras may be under LGPL or MPL, GPL and AGPL
are neither.
"""

import re
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
PERMISSIVE = (
    "MIT", "BSD", "Apache", "ISC", "PSF", "Python Software Foundation", "Zlib", "CC0", "0BSD", "Public Domain",
    "Unlicense", "HPND",
)  # fmt: skip
WEAK = ("MPL", "Mozilla", "LGPL", "Lesser")
"""For optional extras, and for files of theirs that we do not change."""
BUILD = ("editables", "hatchling", "pathspec", "trove-classifiers")
"""The build backend: in the lock of the core, and no part of what is installed from a wheel."""
READ = {"docutils": "Public Domain AND BSD-2-Clause", "python-engineio": "MIT", "python-socketio": "MIT"}
"""Where the metadata say less than the licence file: docutils' GPL part is an editor mode that is not in the wheel."""


class Dependency(NamedTuple):
    """One package of a lock; `licence` None where it is not installed here."""

    name: str
    version: str
    licence: str | None
    core: bool

    @property
    def allowed(self) -> bool:
        """By PERMISSIVE, or for extras by WEAK; alternatives are separated by OR, parts by AND."""
        if self.licence is None:
            return True
        known = PERMISSIVE + (() if self.core else WEAK)
        parts = re.split(r"\s+AND\s+|;|/", self.licence.replace("(", "").replace(")", ""))
        return all(any(_is(each, known) for each in re.split(r"\s+OR\s+", part)) for part in parts)


def _is(licence, known):
    strong = re.search(r"\bA?GPL|General Public", licence) and not re.search(r"LGPL|Lesser", licence)
    return not strong and any(word.lower() in licence.lower() for word in known)


def dependencies() -> list[Dependency]:
    """The packages of requirements.lock; those of requirements-core.lock are the core's."""
    core = dict(_pinned("requirements-core.lock")).keys() - set(BUILD)
    return [Dependency(name, version, _licence(name), name in core) for name, version in _pinned("requirements.lock")]


def _pinned(lock):
    return re.findall(r"^([\w.-]+)==([^\s;\\]+)", (ROOT / lock).read_text(encoding="utf-8"), re.M)


def _licence(name):
    if name in READ:
        return READ[name]
    try:
        metadata = distribution(name).metadata
    except PackageNotFoundError:
        return None
    classifiers = [each.split("::")[-1].strip() for each in metadata.get_all("Classifier") or [] if "License" in each]
    named = [each for each in classifiers if each not in ("OSI Approved", "DFSG approved")]
    return metadata.get("License-Expression") or "; ".join(named) or (metadata.get("License") or "?").splitlines()[0]


def test_every_dependency_has_an_allowed_licence():
    found = dependencies()
    assert len(found) > 50 and sum(each.licence is not None for each in found) > 30
    assert [each for each in found if not each.allowed] == []
