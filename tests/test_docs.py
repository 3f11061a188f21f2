"""The documentation: its code runs, its commands are there, its links lead somewhere; the licences of the locks."""

import re
import shlex
from importlib import import_module
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path

import pytest
import typer
from docs import papers, reference
from docs.build import ROOT, run_python, snippets

import steerway
from steerway.commands.testing import KINDS, command_tree, schema_of
from steerway.control import AnglePID
from tests.scenes import turning

PAGES = sorted(path for path in (ROOT / "docs").rglob("*.md"))
README = ROOT / "README.md"
FRONT = [README, ROOT / "ARCHITECTURE.md", ROOT / "CONTRIBUTING.md"]
SNIPPETS = [path for path in PAGES if "```python" in path.read_text("utf-8")]


def named(path):
    return path.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("path", [*SNIPPETS, README], ids=named)
def test_the_code_of_a_page_runs(path, tmp_path, monkeypatch):
    """That of the front page in a folder with its log, where it says what it prints."""
    if path == README:
        monkeypatch.chdir(tmp_path)
        steerway.write(turning(2.0, 0.5, 60.0).fixes(0.3, 1), "log.csv")
        Path("log.csv").rename("sortie.nmea")
    names = {"__name__": "__main__"}
    for snippet in snippets(path.read_text("utf-8")):
        if snippet.kind == "python":
            said = run_python(snippet, named(path), names)
            assert path != README or bool(said) == ("print(" in snippet.text)
    assert path != README or Path("sortie.parquet").exists()


def command_lines():
    """(page, command) of every line of a block that begins with the program's name, and of commands within text."""
    pages = {named(path): path.read_text("utf-8") for path in [*PAGES, *FRONT]}
    for page, text in (pages | {"the help of the commands": reference.commands()}).items():
        lines = [line.strip() for line in text.splitlines() if re.match(r"( {4})?steerway ", line)]
        lines += re.findall(r"`(steerway [^`]+)`", text)
        for part in (part.strip() for line in lines for part in re.split(r"&&|;", line)):
            if part.startswith("steerway ") and not re.search(r"[…A-Z]{4}|\[", part):
                yield page, part


def test_the_commands_of_the_pages_are_understood():
    lines = sorted(set(command_lines()))
    assert len(lines) > 50
    assert list(filter(None, (mistake(page, line) for page, line in lines))) == []


def mistake(page, line):
    """What is wrong with a command of a page, "" for nothing."""
    words = shlex.split(line, comments=True)[1:]
    words = words[: next((k for k, word in enumerate(words) if word in ("|", ">", "<", "2>")), len(words))]
    command = command_tree()
    context = typer.Context(command, info_name="steerway")
    while words and hasattr(command, "commands") and not words[0].startswith("-"):
        if words[0] not in command.commands:
            return f"{page}: there is no command in {line!r}"
        command = command.commands[words.pop(0)]
    if not words or hasattr(command, "commands"):
        return ""  # named in text, without its arguments
    try:
        command.make_context(command.name, words, parent=context)
    except Exception as error:
        return "" if type(error).__name__ == "MissingParameter" else f"{page}: {line!r}: {error}"
    return ""


def anchors(page):
    titles = re.findall(r"^#+ (.*)$", page, re.MULTILINE)
    return {re.sub(r"[^\w -]", "", title.lower()).strip().replace(" ", "-") for title in titles}


@pytest.mark.parametrize("path", [*PAGES, *FRONT], ids=named)
def test_links_lead_somewhere(path):
    text = path.read_text("utf-8")
    made = {f"{name}.md" for name in ("commands", "columns", "equations", "python", *KINDS)}
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"https?:|mailto:", target):
            continue
        place, _, anchor = target.partition("#")
        goal = (path.parent / place).resolve() if place else path
        if goal.parent.name in ("reference", "schemas") and goal.name in made:
            continue
        assert goal.exists(), f"{target} is not there"
        assert not anchor or anchor in anchors(goal.read_text("utf-8")), f"{target} has no such heading"


def test_every_page_is_in_the_contents():
    contents = (ROOT / "docs" / "mkdocs.yml").read_text("utf-8")
    missing = [path for path in PAGES if path.relative_to(ROOT / "docs").as_posix() not in contents]
    assert missing == []


def test_the_reference_has_every_public_name():
    pages = {name: reference.module(name) for name in reference.MODULES}
    assert all(f"## {public}\n" in page for name, page in pages.items() for public in import_module(name).__all__)
    assert "`course`" in reference.keys("scenario") or "| `law` |" in reference.keys("scenario")
    assert "## steerway estimate" in reference.commands() and "position_std_m" in reference.columns()


@pytest.mark.parametrize("kind", KINDS)
def test_every_key_in_a_schema_has_one_sentence_and_every_number_a_unit(kind):
    schema = schema_of(kind)
    assert schema["title"] == f"Steerway {kind}"
    for name, table in {"": schema, **schema.get("$defs", {})}.items():
        for key, value in table.get("properties", {}).items():
            sentence = value.get("description", "")
            assert sentence.endswith(".") and sentence[0].upper() == sentence[0], f"{kind} {name} {key}"
            plain = {k: v for k, v in value.items() if k not in ("default", "additionalProperties")}
            if '"number"' in str(plain).replace("'", '"'):
                assert value.get("unit"), f"{kind} {name} {key}"


def test_every_equation_of_a_paper_is_placed_or_said_to_be_left_out():
    pages = papers.paper_pages()
    assert f"| (54)–(59) | `{AnglePID.__module__}" in pages["paper-p0"]
    for label, paper in papers.papers().items():
        assert papers.unplaced(label) == []
        for row in paper["rows"]:
            assert bool(row.get("code")) != bool(row.get("left_out")), row
            assert f"| {row['equations']} |" in pages[f"paper-{label.lower()}"]
            for place in row.get("code", ()):
                papers.found_in(place)
        for erratum in paper["errata"]:
            assert {"where", "printed", "used"} <= set(erratum) <= {"where", "printed", "used", "shown"}


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
