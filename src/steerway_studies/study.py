"""What every study gives: named numbers, the published ones compared with the measured ones, figures; and its page.

A study measures a dict of numbers and lists what is compared as data: a `Quantity` a line. Its cases run side by side;
an interrupted study continues with those that are done.
"""

import hashlib
import io
import json
import math
import pickle
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import numpy as np

from steerway.core import NORMAL_95, InputError, complete_or_absent, made_directory
from steerway.report import png, write_page
from steerway.simulation import Unfinished, over_seeds

_kept: Unfinished | None = None


@contextmanager
def keeping(parts: Unfinished | None) -> Iterator[None]:
    """Meanwhile `over_cases` keeps its results in `parts`, and takes from there what is done."""
    global _kept
    before, _kept = _kept, parts
    try:
        yield
    finally:
        _kept = before


def over_cases(run: Callable, cases: Iterable, progress: Callable[[float], None] | None = None) -> list:
    """`steerway.simulation.over_seeds` for cases of any kind; within `keeping` none is run that is done."""
    cases, parts = list(cases), _kept
    if parts is None:
        return over_seeds(run, cases, progress=progress)
    keys = [_key(run, case) for case in cases]
    missing = [k for k, key in enumerate(keys) if key not in parts.results]
    done = len(cases) - len(missing)
    if progress and done:
        progress(done / len(cases))
    over_seeds(
        _Nth(run, cases),
        missing,
        progress=progress and (lambda share: progress((done + share * len(missing)) / len(cases))),
        finished=lambda k, result: parts.add(keys[k], result),
    )
    return [parts.results[key] for key in keys]


class _Nth:
    """`run` of the k-th case."""

    def __init__(self, run, cases):
        self.run, self.cases = run, cases

    def __call__(self, k):
        return self.run(self.cases[k])


def _key(run, case) -> bytes:
    """What is asked for: the function with its arguments, and the case."""
    packed = io.BytesIO()
    pickler = pickle.Pickler(packed)
    pickler.fast = True  # equal values are packed alike, also where they are not one object
    pickler.dump((run, case))
    return hashlib.sha256(packed.getvalue()).digest()


_NUMBER = r"(−?[0-9.e-]+)"
_FORMS = {
    f"≤ {_NUMBER}": lambda value, limit: value <= limit,
    f"≥ {_NUMBER}": lambda value, limit: value >= limit,
    f"< {_NUMBER}": lambda value, limit: value < limit,
    f"> {_NUMBER}": lambda value, limit: value > limit,
    f"{_NUMBER} to {_NUMBER}": lambda value, low, high: low <= value <= high,
    f"{_NUMBER} ± {_NUMBER}": lambda value, centre, room: abs(value - centre) <= room,
    f"{_NUMBER} ± {_NUMBER} %": lambda value, centre, share: abs(value / centre - 1.0) <= 0.01 * share,
    _NUMBER: lambda value, number: value == number,
}
"""How a target is written, and when a number reaches it."""


def reached(target: str, value: float) -> bool:
    """Whether a number reaches a target: "≤ 0.06", "9.7 ± 0.5", "1.9 to 2.1", "> 20: fails" and so on.

    What follows a colon is a note. Raises ValueError for a target that is written otherwise.
    """
    condition = target.split(":")[0]
    for form, holds in _FORMS.items():
        if found := re.fullmatch(form, condition):
            return bool(holds(value, *(float(each.replace("−", "-")) for each in found.groups())))
    raise ValueError(f"target is {target!r}, expected one of {', '.join(_FORMS)}")


_TRIED = 201
"""Values of a 95 % interval at which a target is tried."""


def judged(target: str, value: float, interval: tuple[float, float] | None = None) -> bool | None:
    """Whether a number reaches a target; None where a part of its interval does and another does not."""
    if interval is None or not all(map(math.isfinite, interval)):
        return reached(target, value)
    tried = {reached(target, each) for each in (value, *np.linspace(*interval, _TRIED).tolist())}
    return tried.pop() if len(tried) == 1 else None


def half_width(values: Sequence[float]) -> float:
    """Half the width of the 95 % confidence interval of a mean, by the normal distribution; NaN of one value."""
    return float(NORMAL_95 * np.std(values, ddof=1) / math.sqrt(len(values))) if len(values) > 1 else math.nan


class Quantity(NamedTuple):
    """One line of what a study compares: the key of the measured number, what it is, published and aimed at."""

    key: str
    what: str
    unit: str = ""
    published: str = ""  # as the paper prints it; empty where it gives no number
    target: str = ""  # what is to be reached, see `reached`; empty if nothing


@dataclass(frozen=True)
class Comparison:
    """One measured number, with the published one and the target. `key` names it in `Results.numbers`."""

    what: str
    key: str
    unit: str = ""
    published: str = ""  # as the paper prints it; empty where it gives no number
    target: str = ""  # what is to be reached, in words ("≤ 0.06"); empty if nothing
    met: bool | None = None  # None without a target, and where it is not decided
    interval: tuple[float, float] | None = None  # 95 %, over the repetitions
    section: str = ""  # the heading under which it is shown

    @property
    def verdict(self) -> str:
        """ "met", "missed", "undecided" where the interval reaches to either side of the target, or nothing."""
        if self.met is None:
            return "undecided" if self.target and self.interval else ""
        return "met" if self.met else "missed"


@dataclass
class Results:
    """What a study found. Figures are matplotlib figures by file stem, in the order they are to be shown."""

    title: str
    numbers: dict[str, float] = field(default_factory=dict)  # flat: what results.json holds
    comparisons: list[Comparison] = field(default_factory=list)
    figures: dict[str, tuple[object, str]] = field(default_factory=dict)  # stem → (figure, caption)
    remarks: list[str] = field(default_factory=list)  # what was inferred and what was missed
    tables: list[tuple] = field(default_factory=list)  # further ones of the page: (heading, column names, rows)
    lead: str = ""  # a sentence or two under the title
    section: str = ""  # heading of the comparisons recorded from here on; a study of few has one

    def compare(self, key, value, what, unit="", published="", target="", met=None, interval=None) -> None:
        """Record a number and show it in the table of published, target and measured.

        `interval`: its 95 % interval over the repetitions, recorded as `key`_low and `key`_high.
        """
        self.numbers[key] = float(value)
        met = None if met is None else bool(met)
        if interval is not None:
            interval = float(interval[0]), float(interval[1])
            self.numbers[f"{key}_low"], self.numbers[f"{key}_high"] = interval
        self.comparisons.append(Comparison(what, key, unit, published, target, met, interval, self.section))

    def add(self, numbers: Mapping[str, float], quantities: Iterable[Quantity]) -> None:
        """Record measured numbers, and compare those that are listed."""
        self.numbers |= {key: float(value) for key, value in numbers.items()}
        for key, what, unit, published, target in quantities:
            value, interval = self.numbers[key], self._interval(key)
            met = judged(target, value, interval) if target else None
            self.compare(key, value, what, unit, published, target, met, interval)

    def _interval(self, key) -> tuple[float, float] | None:
        """The 95 % interval of a mean over repetitions, where it is among the numbers."""
        half = self.numbers.get(f"{key}_ci", math.nan)
        return (self.numbers[key] - half, self.numbers[key] + half) if math.isfinite(half) else None

    def measured(self, comparison: Comparison) -> str:
        """The measured number as text, with its interval if it has one."""
        text = f"{self.numbers[comparison.key]:.4g}"
        if comparison.interval is not None:
            text += " ({:.3g} to {:.3g})".format(*comparison.interval)
        return f"{text} {comparison.unit}".rstrip()

    def write(self, directory: Path) -> Path:
        """Write results.json, the figures as PNG and the page that shows them; returns the page's path.

        Raises InputError for what cannot be written.
        """
        made_directory(directory)
        numbers = {key: value if math.isfinite(value) else None for key, value in self.numbers.items()}
        if numbers:
            with complete_or_absent(directory / "results.json") as file:
                file.write(json.dumps(numbers, indent=2).encode() + b"\n")
        figures = {stem: (png(figure), caption) for stem, (figure, caption) in self.figures.items()}
        for stem, (picture, _) in figures.items():
            with complete_or_absent(directory / f"{stem}.png") as file:
                file.write(picture)
        sections = {}
        for each in self.comparisons:
            sections.setdefault(each.section, []).append(each)
        compared = [self._table(heading, each) for heading, each in sections.items()]
        # A study of several sections begins with a summary and ends with every number.
        verdict = [self._verdict(sections)] if len(sections) > 1 else []
        page = directory / "index.html"
        write_page(
            page,
            title=self.title,
            tables=verdict or [*compared, *self.tables],
            figures=list(figures.values()),
            remarks=self.remarks,
            lead=self.lead,
            details=[*compared, *self.tables] if verdict else (),
        )
        return page

    def _table(self, heading, comparisons) -> tuple:
        rows = [
            (each.what, _with_unit(each.published, each.unit), each.target, self.measured(each), each.verdict)
            for each in comparisons
        ]
        return heading or "Published, target and measured", _COLUMNS, rows

    def _verdict(self, sections) -> tuple:
        """For every section with targets: how many are met, and the first that are not."""
        rows = []
        for heading, comparisons in sections.items():
            aimed = [each for each in comparisons if each.verdict]
            missed = [each for each in aimed if not each.met]
            if not aimed:
                continue
            named = [f"{each.what}: {self.measured(each)}, target {each.target}" for each in missed[:_NAMED_MISSES]]
            if len(missed) > _NAMED_MISSES:
                named.append(f"and {len(missed) - _NAMED_MISSES} more")
            met = len(aimed) - len(missed)
            worst = next(
                (word for word in ("missed", "undecided") if any(each.verdict == word for each in missed)), "met"
            )
            rows.append((heading, f"{met} of {len(aimed)}", worst, "; ".join(named)))
        return "Verdict", ("section", "targets met", "all met?", "targets not met"), rows


_COLUMNS = "quantity", "published in the paper", "target of this study", "measured here", "target met?"
_NAMED_MISSES = 3


def _with_unit(published, unit) -> str:
    """The published value with the unit of the measured one, where it is a plain number."""
    return f"{published} {unit}".rstrip() if published.replace("−", "").replace(".", "").isdigit() else published


@dataclass(frozen=True)
class Study:
    """A named study. `run(seeds, first_seed, progress)` takes None for the repetition counts it is defined with."""

    name: str
    summary: str
    run: Callable[[int | None, int, Callable[[float, str], None] | None], Results]
    needs: tuple[str, ...] = ()  # packages beyond the dependencies of steerway, which the extra `studies` brings
    run_full: Callable[[int | None, int, Callable[[float, str], None] | None], Results] | None = None
    """As `run`, with all cases of every seed, where a seed of `run` draws a part of them."""
    drawn: Callable[[int], dict] | None = None
    """The figures that need no statistics, by stem, of one seed."""

    def figures_only(self, seed: int) -> Results:
        """The figures of one seed, without numbers. Raises InputError where all of them need the whole study."""
        if self.drawn is None:
            raise InputError(f"study {self.name} draws its figures of all its runs, expected no --figures-only")
        lead = f"Figures of seed {seed} alone; `steerway study {self.name}` measures what is compared."
        return Results(f"{self.name}: {self.summary}", figures=self.drawn(seed), lead=lead)

    def run_keeping(self, parts: Unfinished | None, seeds, first_seed, progress, full: bool = False) -> Results:
        """`run`, or `run_full`, with finished cases kept in `parts` and taken from there.

        Raises InputError for all cases of a study whose seeds draw none.
        """
        if full and self.run_full is None:
            raise InputError(f"study {self.name} runs all its cases with every seed, expected no --full")
        with keeping(parts):
            return (self.run_full if full else self.run)(seeds, first_seed, progress)

    def check_installed(self) -> None:
        """Raises InputError if a package that the study needs is not installed."""
        missing = [name for name in self.needs if find_spec(name) is None]
        if missing:
            raise InputError(
                f"study {self.name} needs the package {missing[0]}, expected pip install '.[studies]' in a clone of "
                "steerway"
            )


def means(rows: list[dict[str, float]], keys: Iterable[str] | None = None) -> dict[str, float]:
    """The mean over runs of every number, or of those named; with half its 95 % interval under `…_ci` of several."""
    found = {}
    for key in keys or rows[0]:
        values = [row[key] for row in rows]
        found[key] = float(np.mean(values))
        if len(values) > 1:
            found[f"{key}_ci"] = half_width(values)
    return found


def seeds_from(first: int, count: int | None, usual: int) -> range:
    """The seeds of a run: `count` of them, or `usual` where none is given."""
    return range(first, first + (count or usual))


def stage(progress, began: float, share: float, words: str):
    """The progress of one stage of a study: a function of the part that is done; None without `progress`."""
    return progress and (lambda part: progress(began + share * part, words))
