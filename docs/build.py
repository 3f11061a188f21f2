"""Builds the documentation site: pages with their snippets run, the generated reference, links checked.

python docs/build.py [SITE]   (make docs)

Python blocks of a page run in their order, in one namespace; blocks marked `sh run` run in a shell. Their output is
inserted below them, and so is a matplotlib Figure assigned to `figure`.
"""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
sys.path[:0] = [str(ROOT), str(ROOT / "src")]
_BLOCK = re.compile(r"^```(python|sh run|sh)\n(.*?)^```\n", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True)
class Snippet:
    """A block of code in a page: its kind ("python", "sh", "sh run"), text, first line and place in the page."""

    kind: str
    text: str
    line: int
    stop: int


def snippets(page: str) -> Iterator[Snippet]:
    """The blocks of code of a page."""
    for block in _BLOCK.finditer(page):
        yield Snippet(block[1], block[2], page.count("\n", 0, block.start()) + 2, block.end())


def run_python(snippet: Snippet, page: str, names: dict) -> str:
    """Run a Python block in the namespace `names`; returns its output."""
    printed = StringIO()
    with redirect_stdout(printed):
        exec(compile("\n" * (snippet.line - 1) + snippet.text, page, "exec"), names)
    return printed.getvalue()


def run_shell(snippet: Snippet, folder: Path) -> str:
    """Run the lines of a shell block in a folder; returns their output. Raises RuntimeError if one fails."""
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    places = os.pathsep.join(map(str, (ROOT / "src", ROOT)))
    surroundings = os.environ | {"PATH": path, "PYTHONPATH": places, "COLUMNS": "110"}
    alias = f'steerway() {{ "{sys.executable}" -c "from steerway.commands.cli import main; main()" "$@"; }}\n'
    command = ["bash", "-ec", alias + snippet.text]
    done = subprocess.run(command, cwd=folder, env=surroundings, capture_output=True, text=True, timeout=900)
    if done.returncode:
        raise RuntimeError(f"{snippet.text}ended with {done.returncode}: {done.stderr}")
    return done.stdout


def executed(page: str, name: str, folder: Path, images: Path) -> str:
    """The page with the output and the figures of its blocks below them."""
    names, out, at = {"__name__": "__main__"}, [], 0
    for number, snippet in enumerate(snippets(page)):
        out.append(page[at : snippet.stop].replace("```sh run\n", "```sh\n"))
        at = snippet.stop
        if snippet.kind == "sh":
            continue
        printed = run_python(snippet, name, names) if snippet.kind == "python" else run_shell(snippet, folder)
        if printed.strip():
            out.append(f"\n```text\n{printed.rstrip()}\n```\n")
        figure = names.pop("figure", None)
        if figure is not None:
            image = images / f"{Path(name).stem}-{number}.png"
            image.parent.mkdir(parents=True, exist_ok=True)
            figure.savefig(image, dpi=110)
            out.append(f"\n![Figure made by the code above](../images/made/{image.name})\n")
    return "".join([*out, page[at:]])


def build(site: Path) -> None:
    """Build the site into a folder."""
    from docs import reference

    work = ROOT / "build" / "docs"
    shutil.rmtree(work, ignore_errors=True)
    folder = ROOT / "build" / "snippets"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / "examples").symlink_to(ROOT / "examples")
    pages = work / "pages"
    shutil.copytree(DOCS, pages, ignore=shutil.ignore_patterns("*.py", "__pycache__"))
    for page in sorted(pages.rglob("*.md")):
        place = page.relative_to(pages).as_posix()
        print(f"runs {place}", flush=True)
        page.write_text(executed(within(page.read_text("utf-8")), place, folder, pages / "images" / "made"), "utf-8")
    shutil.copytree(ROOT / "examples", pages / "examples")
    reference.write(pages / "reference")
    reference.write_schemas(pages / "schemas")
    (pages / "index.md").write_text(home((ROOT / "README.md").read_text("utf-8")), "utf-8")
    for name in ("ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md"):
        (pages / name.lower()).write_text(home((ROOT / name).read_text("utf-8")), "utf-8")
    settings = (DOCS / "mkdocs.yml").read_text("utf-8")
    listed = "".join(
        f"\n          - reference/{each.name}" for each in sorted((pages / "reference").glob("python-*.md"))
    )
    (work / "mkdocs.yml").write_text(settings.replace(" PYTHON", listed), "utf-8")
    (pages / "mkdocs.yml").unlink()
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "-f", "mkdocs.yml", "-d", str(site)]
    subprocess.run(command, cwd=work, check=True, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"})


def home(readme: str) -> str:
    """A page of the repository's root as one of the site: links into docs are links beside it."""
    page = re.sub(r"\]\(docs/", "](", readme)
    page = re.sub(r"\]\((ARCHITECTURE|CHANGELOG|CONTRIBUTING)\.md\)", lambda found: f"]({found[1].lower()}.md)", page)
    return re.sub(r"\[([^\]]*)\]\((?!https?:|#|[\w/.-]+\.(?:md|png|html)(?:#|\)))([^)]*)\)", r"\1", page)


def within(page: str) -> str:
    """A page of docs/ as one of the site: links to examples lead to its copy, others out of docs become text."""
    page = re.sub(r"\]\(\.\./((?:\.\./)?examples/)", r"](\1", page)
    return re.sub(r"\[([^\]]*)\]\((?:\.\./)+integrations/[^)]*\)", r"\1", page)


if __name__ == "__main__":
    build(Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "site").resolve())
