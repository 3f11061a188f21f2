"""The results of a study: named numbers, published numbers compared with measured ones, figures, and a page.

A study measures a dict of numbers. Each line of its comparison is a `Quantity`. Its cases run in parallel; an
interrupted study keeps the finished cases and continues with the others.
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
    """Within this context `over_cases` keeps finished results in `parts` and does not run them again."""
    global _kept
    before, _kept = _kept, parts
    try:
        yield
    finally:
        _kept = before


def over_cases(run: Callable, cases: Iterable, progress: Callable[[float], None] | None = None) -> list:
    """`steerway.simulation.over_seeds` for cases of any kind; within `keeping`, finished cases are not run again."""
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
    """A function of k that runs the k-th case."""

    def __init__(self, run, cases):
        self.run, self.cases = run, cases

    def __call__(self, k):
        return self.run(self.cases[k])


def _key(run, case) -> bytes:
    """Hash of the function, with its bound arguments, and of the case."""
    packed = io.BytesIO()
    pickler = pickle.Pickler(packed)
    pickler.fast = True  # equal values give equal bytes, also if they are not the same object
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
"""Form of a target → whether a number reaches it."""


def reached(target: str, value: float) -> bool:
    """Whether a number reaches a target: "≤ 0.06", "9.7 ± 0.5", "1.9 to 2.1", "> 20: fails" and so on.

    Text after a colon is a note. Raises ValueError for a target of another form.
    """
    condition = target.split(":")[0]
    for form, holds in _FORMS.items():
        if found := re.fullmatch(form, condition):
            return bool(holds(value, *(float(each.replace("−", "-")) for each in found.groups())))
    raise ValueError(f"target is {target!r}, expected one of {', '.join(_FORMS)}")


_TRIED = 201
"""Number of values in a 95 % interval for which a target is evaluated."""


def judged(target: str, value: float, interval: tuple[float, float] | None = None) -> bool | None:
    """Whether a number and its whole interval reach a target; None if only a part of the interval does."""
    if interval is None or not all(map(math.isfinite, interval)):
        return reached(target, value)
    tried = {reached(target, each) for each in (value, *np.linspace(*interval, _TRIED).tolist())}
    return tried.pop() if len(tried) == 1 else None


def half_width(values: Sequence[float]) -> float:
    """Half the width of the 95 % confidence interval of a mean, by the normal distribution; NaN for a single value."""
    return float(NORMAL_95 * np.std(values, ddof=1) / math.sqrt(len(values))) if len(values) > 1 else math.nan


class Quantity(NamedTuple):
    """One line of a study's comparison: key of the measured number, its description, published value and target."""

    key: str
    what: str
    unit: str = ""
    published: str = ""  # as the paper prints it; empty if it gives no number
    target: str = ""  # in a form of `reached`; empty without a target


@dataclass(frozen=True)
class Comparison:
    """One measured number, with the published one and the target. `key` names it in `Results.numbers`."""

    what: str
    key: str
    unit: str = ""
    published: str = ""  # as the paper prints it; empty if it gives no number
    target: str = ""  # as text ("≤ 0.06"); empty without a target
    met: bool | None = None  # None without a target, and if undecided
    interval: tuple[float, float] | None = None  # 95 % interval of the mean over the repetitions
    section: str = ""  # its heading on the page

    @property
    def verdict(self) -> str:
        """ "met", "missed", "undecided" if only a part of the interval reaches the target, or "" without a target."""
        if self.met is None:
            return "undecided" if self.target and self.interval else ""
        return "met" if self.met else "missed"


@dataclass
class Results:
    """The results of a study. Figures are matplotlib figures by file stem, in the order in which they are shown."""

    title: str
    numbers: dict[str, float] = field(default_factory=dict)  # flat: the content of results.json
    comparisons: list[Comparison] = field(default_factory=list)
    figures: dict[str, tuple[object, str]] = field(default_factory=dict)  # stem → (figure, caption)
    remarks: list[str] = field(default_factory=list)  # assumptions that the paper leaves open, and missed targets
    tables: list[tuple] = field(default_factory=list)  # further tables of the page: (heading, column names, rows)
    lead: str = ""  # a sentence or two under the title
    section: str = ""  # heading of the comparisons that are recorded next

    def compare(self, key, value, what, unit="", published="", target="", met=None, interval=None) -> None:
        """Record a number and add it to the table of published values, targets and measured values.

        `interval`: the number's 95 % interval over the repetitions, recorded as `key`_low and `key`_high.
        """
        self.numbers[key] = float(value)
        met = None if met is None else bool(met)
        if interval is not None:
            interval = float(interval[0]), float(interval[1])
            self.numbers[f"{key}_low"], self.numbers[f"{key}_high"] = interval
        self.comparisons.append(Comparison(what, key, unit, published, target, met, interval, self.section))

    def add(self, numbers: Mapping[str, float], quantities: Iterable[Quantity]) -> None:
        """Record measured numbers, and compare those in `quantities`."""
        self.numbers |= {key: float(value) for key, value in numbers.items()}
        for key, what, unit, published, target in quantities:
            value, interval = self.numbers[key], self._interval(key)
            met = judged(target, value, interval) if target else None
            self.compare(key, value, what, unit, published, target, met, interval)

    def _interval(self, key) -> tuple[float, float] | None:
        """The 95 % interval of a mean over repetitions; None if its half width is not among the numbers."""
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

        Raises InputError if a file cannot be written.
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
        """Table with the number of targets met in every section, and the first that are missed."""
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
    """The published value, with the unit of the measured one if it is a plain number."""
    return f"{published} {unit}".rstrip() if published.replace("−", "").replace(".", "").isdigit() else published


@dataclass(frozen=True)
class Study:
    """A named study. `run(seeds, first_seed, progress)`; with None for `seeds` it uses its own repetition counts."""

    name: str
    summary: str
    run: Callable[[int | None, int, Callable[[float, str], None] | None], Results]
    needs: tuple[str, ...] = ()  # packages beyond the dependencies of steerway, which the extra `studies` brings
    run_full: Callable[[int | None, int, Callable[[float, str], None] | None], Results] | None = None
    """As `run`, but with all cases for every seed; for studies in which a seed of `run` draws some of the cases."""
    drawn: Callable[[int], dict] | None = None
    """Function of a seed that returns the figures which need no statistics, by stem."""

    def figures_only(self, seed: int) -> Results:
        """The figures of one seed, without numbers. Raises InputError if every figure needs the whole study."""
        if self.drawn is None:
            raise InputError(f"study {self.name} draws its figures from all its runs, expected no --figures-only")
        lead = f"Figures of seed {seed} alone; `steerway study {self.name}` measures the numbers."
        return Results(f"{self.name}: {self.summary}", figures=self.drawn(seed), lead=lead)

    def run_keeping(self, parts: Unfinished | None, seeds, first_seed, progress, full: bool = False) -> Results:
        """`run`, or `run_full`; finished cases are kept in `parts` and not run again.

        Raises InputError if `full` is given for a study that always runs all its cases.
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
    """The mean over runs of every number, or of those in `keys`; for several runs, half its 95 % interval as `…_ci`."""
    found = {}
    for key in keys or rows[0]:
        values = [row[key] for row in rows]
        found[key] = float(np.mean(values))
        if len(values) > 1:
            found[f"{key}_ci"] = half_width(values)
    return found


def seeds_from(first: int, count: int | None, usual: int) -> range:
    """The seeds of a run, from `first` on: `count` of them, or `usual` if `count` is None."""
    return range(first, first + (count or usual))


def stage(progress, began: float, share: float, words: str):
    """A progress function of one stage, which takes the finished share of the stage; None without `progress`."""
    return progress and (lambda part: progress(began + share * part, words))
