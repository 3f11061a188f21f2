"""The pages of the papers: the place of every numbered equation in the code, and the errata.

Generated from the citations in docstrings and from `steerway_studies/papers/errata.toml`.
"""

import ast
import re
import tomllib
from functools import cache
from importlib import import_module
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[1] / "src"
_RANGE = r"\(\d+[a-z]?\)(?:–\(\d+[a-z]?\))?"
_CITED = re.compile(rf"\b(P[0-4])\s((?:Table|Appendix|§)\s?[IVX0-9A-Z]+|{_RANGE}(?:(?:, | and ){_RANGE})*)")


def papers() -> dict[str, dict]:
    """The papers by label: title, last equation, rows and errata."""
    text = (SOURCE / "steerway_studies" / "papers" / "errata.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


@cache
def cited() -> list[tuple[str, str, str]]:
    """(paper, equations, place) of every citation in a docstring."""
    rows = []
    for path in sorted(SOURCE.rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        place = path.relative_to(SOURCE).with_suffix("").as_posix().replace("/", ".").removesuffix(".__init__")
        for node in ast.walk(tree):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                doc = ast.get_docstring(node) or ""
                name = "" if isinstance(node, ast.Module) else f".{node.name}"
                rows += [(paper, each, f"{place}{name}") for paper, each in _CITED.findall(doc)]
    return rows


def numbers(equations: str) -> set[int]:
    """The set of numbers in "(1)–(3), (5)"; empty for a table or a section."""
    found: set[int] = set()
    for part in re.findall(_RANGE, equations):
        first, *last = (int(each) for each in re.findall(r"\d+", part))
        found |= set(range(first, (last or [first])[0] + 1))
    return found


def unplaced(label: str) -> list[int]:
    """The equations of a paper that are neither in the code nor said to be left out."""
    paper = papers()[label]
    places = [each for which, each, _ in cited() if which == label] + [row["equations"] for row in paper["rows"]]
    return sorted(set(range(1, paper["last"] + 1)).difference(*map(numbers, places)))


def found_in(place: str) -> object:
    """The object with a dotted name of `rows`; raises LookupError for an unknown name."""
    parts = place.split(".")
    for end in range(len(parts), 0, -1):
        try:
            found = import_module(".".join(parts[:end]))
        except ModuleNotFoundError:
            continue
        for name in parts[end:]:
            if not hasattr(found, name):
                raise LookupError(place)
            found = getattr(found, name)
        return found
    raise LookupError(place)


def paper_pages() -> dict[str, str]:
    """Pages by name: one a paper, and one that lists them."""
    all_cited, pages, listed = cited(), {}, []
    for label, paper in papers().items():
        pages[f"paper-{label.lower()}"] = _page(label, paper, [each for each in all_cited if each[0] == label])
        listed.append(f"- [{label}](paper-{label.lower()}.md): {paper['title']}")
    lead = "Places of the numbered equations in the code, and errata. `examples/p0.toml` to `p4.toml` are "
    pages["equations"] = (
        "# Equations and errata of the papers\n\n" + lead + "the papers' own runs.\n\n" + "\n".join(listed) + "\n"
    )
    return pages


def _page(label, paper, citations):
    places: dict[str, list[str]] = {}
    for _, equations, place in citations:
        places.setdefault(equations, []).append(f"`{place}`")
    for row in paper["rows"]:
        code = [f"`{each}`" for each in row.get("code", ())] or [f"left out: {row['left_out']}"]
        places.setdefault(row["equations"], []).extend(code)
    lines = [f"| {each} | {', '.join(sorted(set(places[each])))} |" for each in sorted(places, key=_by_number)]
    keys = ("where", "printed", "used", "shown")
    errata = [f"| {' | '.join(_cell(each.get(key, '')) for key in keys)} |" for each in paper["errata"]]
    return "\n".join(
        [
            f"# {label}\n\n{paper['title']}.\n\n## Equations\n",
            "| equation, table | place in the code |",
            "|---|---|",
            *lines,
            "\n## Errata\n",
            "| where | as printed | used here | published and measured |",
            "|---|---|---|---|",
            *errata,
            "",
        ]
    )


def _cell(text):
    return text.replace("|", "\\|").replace("*", "\\*")


def _by_number(equations):
    number = re.search(r"\d+", equations)
    return not equations.startswith("("), int(number[0]) if number else 0, equations
