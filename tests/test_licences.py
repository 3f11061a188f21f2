"""The licence of every dependency of the lock files, from the packages as installed, is one that the project's allows.

The package itself is MIT; what it requires has to be permissive, optional extras may be under LGPL or MPL, GPL and AGPL
are neither.
"""

import re
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path

ROOT = Path(__file__).parents[1]
PERMISSIVE = "MIT|BSD|Apache|ISC|PSF|Python Software|Zlib|CC0|Public Domain|Unlicense|HPND"
WEAK = "|MPL|Mozilla|LGPL|Lesser"
"""For optional extras, and for files of theirs that we do not change."""
BUILD = {"editables", "hatchling", "pathspec", "trove-classifiers"}
"""The build backend: in the lock of the core, and no part of what is installed from a wheel."""
READ = {"docutils": "Public Domain AND BSD-2-Clause", "python-engineio": "MIT", "python-socketio": "MIT"}
"""Where the metadata say less than the licence file: docutils' GPL part is an editor mode that is not in the wheel."""


def pinned(lock):
    return set(re.findall(r"^([\w.-]+)==", (ROOT / lock).read_text(encoding="utf-8"), re.M))


def licence(name):
    """The licence that a package states; "" where it is not installed here."""
    try:
        stated = metadata(name)
    except PackageNotFoundError:
        return ""
    classifiers = re.findall(r"License :: (?:.* :: )?(.+)", "\n".join(stated.get_all("Classifier") or []))
    named = [each for each in classifiers if each not in ("OSI Approved", "DFSG approved")]
    return READ.get(name) or stated.get("License-Expression") or "; ".join(named) or (stated.get("License") or "?")


def test_every_dependency_has_an_allowed_licence():
    """Alternatives are separated by OR, parts by AND."""
    everything, core = pinned("requirements.lock"), pinned("requirements-core.lock") - BUILD
    licences = {name: found.splitlines()[0] for name in everything if (found := licence(name))}
    assert len(everything) > 50 and len(licences) > 30
    for name, found in licences.items():
        allowed = re.compile(PERMISSIVE if name in core else PERMISSIVE + WEAK, re.I)
        for part in re.split(r"\s+AND\s+|;|/", found):
            assert any(
                allowed.search(each) and not re.search(r"\bA?GPL|(?<!Lesser )General Public", each)
                for each in re.split(r"\s+OR\s+", part)
            ), f"{name}: {found}"
