"""What every study gives: named numbers, published beside measured, figures; and how it is written out."""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Comparison:
    """One number of a paper beside ours. `key` names the measured number in `Results.numbers`."""

    what: str
    key: str
    unit: str = ""
    published: str = ""  # as the paper has it; empty where it is silent
    target: str = ""  # what we set out to reach, in words ("≤ 0.06"), empty if nothing
    met: bool | None = None
    interval: tuple[float, float] | None = None  # 95 %, over the repetitions
    section: str = ""  # the heading under which it is shown


@dataclass
class Results:
    """What a study found. Figures are matplotlib figures by file stem, in the order they are to be shown."""

    title: str
    numbers: dict[str, float] = field(default_factory=dict)  # flat: what results.json holds
    comparisons: list[Comparison] = field(default_factory=list)
    figures: dict[str, tuple[object, str]] = field(default_factory=dict)  # stem → (figure, caption)
    remarks: list[str] = field(default_factory=list)  # what was inferred, what was missed, said plainly
    tables: list[tuple] = field(default_factory=list)  # further ones of the page: (heading, column names, rows)
    lead: str = ""  # a sentence or two under the title
    section: str = ""  # heading of the comparisons recorded from here on; a study of few has one

    def compare(self, key, value, what, unit="", published="", target="", met=None, interval=None) -> None:
        """Record a number and show it in the table of published against measured.

        `interval`: its 95 % interval over the repetitions, recorded as `key`_low and `key`_high.
        """
        self.numbers[key] = float(value)
        met = None if met is None else bool(met)
        if interval is not None:
            interval = float(interval[0]), float(interval[1])
            self.numbers[f"{key}_low"], self.numbers[f"{key}_high"] = interval
        self.comparisons.append(Comparison(what, key, unit, published, target, met, interval, self.section))

    def measured(self, comparison: Comparison) -> str:
        """The measured number in words, with its interval if it has one."""
        text = f"{self.numbers[comparison.key]:.4g}"
        if comparison.interval is not None:
            text += " ({:.3g} to {:.3g})".format(*comparison.interval)
        return f"{text} {comparison.unit}".rstrip()


@dataclass(frozen=True)
class Study:
    """A named study. `run(seeds, first_seed, progress)` takes None for the repetition counts it is defined with."""

    name: str
    summary: str
    run: Callable[[int | None, int, Callable[[float, str], None] | None], Results]


def write_results(results: Results, directory: Path) -> Path:
    """results.json, the figures as PNG and the page that shows them; returns the page's path."""
    from steerway.report import write_page

    directory.mkdir(parents=True, exist_ok=True)
    numbers = {key: value if math.isfinite(value) else None for key, value in results.numbers.items()}
    (directory / "results.json").write_text(json.dumps(numbers, indent=2) + "\n", encoding="utf-8")
    for stem, (figure, _) in results.figures.items():
        figure.savefig(directory / f"{stem}.png", dpi=120)
    page = directory / "index.html"
    of_section = {}
    for each in results.comparisons:
        of_section.setdefault(each.section, []).append(each)
    compared = [_table(results, heading, each) for heading, each in of_section.items()]
    # A long study says in brief what came out, and why, before it shows every number.
    verdict = [_verdict(results, of_section)] if len(of_section) > 1 else []
    write_page(
        page,
        title=results.title,
        tables=verdict or [*compared, *results.tables],
        figures=list(results.figures.values()),
        remarks=results.remarks,
        lead=results.lead,
        details=[*compared, *results.tables] if verdict else (),
    )
    return page


def _table(results, heading, comparisons) -> tuple:
    words = {True: "met", False: "missed", None: ""}
    rows = [(each.what, each.published, results.measured(each), each.target, words[each.met]) for each in comparisons]
    return heading or "Published beside measured", ("what", "published", "measured", "target", ""), rows


_NAMED_MISSES = 3


def _verdict(results, of_section) -> tuple:
    """Of every section that has targets how many are met, and the first that are not."""
    rows = []
    for heading, comparisons in of_section.items():
        judged = [each for each in comparisons if each.met is not None]
        missed = [each for each in judged if not each.met]
        if not judged:
            continue
        named = [f"{each.what}: {results.measured(each)}, target {each.target}" for each in missed[:_NAMED_MISSES]]
        if len(missed) > _NAMED_MISSES:
            named.append(f"and {len(missed) - _NAMED_MISSES} more")
        met = len(judged) - len(missed)
        rows.append((heading, f"{met} of {len(judged)}", "missed" if missed else "met", "; ".join(named)))
    return "Verdict", ("", "targets met", "", "what is missed"), rows
