"""`python -m tests.mutants`: mutations of core files that the tests must notice.

A random sample of cosmic-ray's mutations of the files below, each in a copy of the project, with the tests that cover
its file and kernels run as Python. Lists what survives. Decorators and annotations are left alone: without compilation
they have no effect.
"""

import argparse
import ast
import os
import random
import shlex
import shutil
import sys
import tempfile
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import NamedTuple

from steerway.core.testing import in_workers

ROOT = Path(__file__).parents[1]
LEAST = 0.9
"""Share that the tests must notice."""
_COPIED = ("src", "tests", "examples", "docs", "pyproject.toml", "README.md")
_LIMIT = 150  # s of processor time, three times what the slowest tests take: a mutation may loop for ever
_PATIENCE = 1500.0  # s until one counts as waiting for ever, however busy the machine
_LEFT_ALONE = ("RemoveDecorator", "ExceptionReplacer")
ARCHIVE = (
    "test_archive_filters.py::test_encounters_trips_and_wrong_values",
    "test_archive.py::test_raw_ais_with_tag_blocks_and_a_vessel_of_class_b_has_its_profile",
)
REFERENCE = "test_reference_outputs.py::test_output_is_as_accepted"
ROUTES = ("adaptive", "integral", "line_of_sight", "pure_pursuit", "vector_field", "voyage_with_stays")
GUIDANCE = (*(f"{REFERENCE}[guidance_{each}]" for each in ROUTES), "test_waypoints", "test_guidance", "test_reference")
SMOOTHER = ("test_two_filter_smoother",)
FIVE_STATE = (
    "test_table_one",
    *(
        f"{REFERENCE}[course-{each}-causal]"
        for each in ("kind-time-std", "trouble-gaps-one-mode", "rate-lower-one-mode")
    ),
)
LOOP = (
    "test_loop.py::test_an_otter_sails_her_route_and_stops",
    "test_loop.py::test_the_same_seed_is_the_same_run_and_another_is_not",
    "test_loop.py::test_a_boat_without_fixes_switches_off_and_goes_on_when_they_return",
    "test_loop.py::test_what_cannot_be_sailed_is_said",
)
COVERED = {
    "core/angles.py": ("test_earth",),
    "core/earth.py": ("test_earth",),
    "core/kalman.py": ("test_table_one.py::test_a_fix_with_error_states", f"{REFERENCE}[speed_surge_filter]"),
    "core/kinematics.py": ("test_earth",),
    "core/reference.py": GUIDANCE,
    "core/wheel_over.py": (*GUIDANCE, "test_turns"),
    "estimation/filter/five_state.py": FIVE_STATE,
    "archive/association.py": ARCHIVE,
    "archive/encounters.py": ARCHIVE,
    "archive/inputs.py": ARCHIVE,
    "control/allocation.py": ("test_allocation",),
    "control/handover.py": ("test_handover",),
    "control/speed.py": ("test_speed_control", f"{REFERENCE}[speed_adaptive]"),
    "control/speed_observer.py": ("test_speed_control",),
    "control/speed_pi.py": ("test_speed_control", f"{REFERENCE}[speed_pi]"),
    "control/station.py": ("test_handover",),
    "estimation/filter/fuse.py": SMOOTHER,
    "estimation/filter/reversal.py": SMOOTHER,
    "formats/ais.py": ("test_ais", "test_reading", *ARCHIVE),
    "formats/ais_tables.py": ("test_ais", *ARCHIVE),
    "formats/columns.py": ("test_table", "test_table_kinds"),
    "formats/dilution.py": ("test_accuracy", "test_binary_logs.py::test_a_binary_data_flash_log"),
    "formats/gpx.py": ("test_other_formats", "test_writing", "test_reading"),
    "formats/nmea0183/writing.py": ("test_writing",),
    "formats/nmea2000/decoder.py": ("test_nmea2000",),
    "formats/reading.py": ("test_reading",),
    "formats/table.py": ("test_table", "test_table_kinds", "test_reading"),
    "formats/ubx.py": ("test_binary_logs", "test_reading"),
    "formats/writing.py": ("test_writing",),
    "guidance/corners.py": GUIDANCE,
    "guidance/line_of_sight.py": GUIDANCE,
    "guidance/route.py": GUIDANCE,
    "guidance/waypoints.py": GUIDANCE,
    "live/mavlink/decoding.py": ("test_mavlink_decoding",),
    "formats/nmea2000/frames.py": ("test_live_n2k",),
    "live/startup_buffer.py": ("test_live_opening",),
    "sensors/gnss.py": ("test_sensors",),
    "simulation/loop.py": LOOP,
    "simulation/reading.py": ("test_scenario", "test_kinds"),
    "simulation/scenario.py": ("test_scenario", "test_kinds"),
}
"""File of `steerway` → files of tests, or single tests, that cover it."""


class Mutant(NamedTuple):
    """One mutation: of a file, by an operator of cosmic-ray, at one of the places it applies to."""

    file: str
    operator: str
    occurrence: int


def mutants() -> list[Mutant]:
    """All of the files above that change what a file does."""
    from cosmic_ray import plugins
    from cosmic_ray.ast import ast_nodes, get_ast_from_path

    found = []
    for file in COVERED:
        tree = get_ast_from_path(_source(file))
        for name in plugins.operator_names():
            kind = plugins.get_operator(name)
            if kind.arguments() or any(words in name for words in _LEFT_ALONE):
                continue
            places = [place for node in ast_nodes(tree) for place in kind().mutation_positions(node)]
            found += [Mutant(file, name, k) for k in range(len(places))]
    return found


def mutated(mutant: Mutant) -> str | None:
    """The file's text with the mutation; None where it does the same."""
    from cosmic_ray import plugins
    from cosmic_ray.mutating import mutate_code

    before = _source(mutant.file).read_text(encoding="utf-8")
    after = mutate_code(before, plugins.get_operator(mutant.operator)(), mutant.occurrence)
    if after is None:
        return None
    try:
        return None if _meaning(after) == _meaning(before) else after
    except SyntaxError:
        return None


def survives(folder: str, mutant: Mutant) -> str:
    """The mutation as changed lines, if the tests do not notice it; else ""."""
    from cosmic_ray.mutating import mutate_and_test
    from cosmic_ray.work_item import MutationSpec, TestOutcome

    copy = Path(folder, str(os.getpid()))
    if not copy.exists():
        copy.mkdir(parents=True)
        for name in _COPIED:
            (shutil.copytree if (ROOT / name).is_dir() else shutil.copy)(ROOT / name, copy / name)
    os.chdir(copy)
    os.environ |= {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": f"{copy / 'src'}{os.pathsep}{copy}"}
    tests = [f"tests/{name}" if "::" in name else f"tests/{name}.py" for name in COVERED[mutant.file]]
    quiet = ["-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "-o", "timeout=0"]
    quiet += ["-o", "filterwarnings="]  # Python's divisions warn
    pytest = shlex.join([sys.executable, "-m", "pytest", *quiet, *tests])
    # On a busy machine, tests that pass take longer, and would count as having noticed: their limit is processor time.
    limited = shlex.join(["sh", "-c", f"ulimit -t {_LIMIT}; exec {pytest}"])
    place = MutationSpec(copy / "src" / "steerway" / mutant.file, mutant.operator, mutant.occurrence, (0, 0), (0, 1))
    result = mutate_and_test([place], limited, _PATIENCE)
    if result.test_outcome == TestOutcome.INCOMPETENT:
        raise RuntimeError(result.output)
    if result.test_outcome != TestOutcome.SURVIVED:
        return ""
    return "\n".join(line for line in result.diff.splitlines() if line[:1] in "@+-" and line[:3] not in ("+++", "---"))


def _source(file):
    return ROOT / "src" / "steerway" / file


def _meaning(source):
    """The syntax tree without annotations."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            node.returns = None
        elif isinstance(node, ast.arg):
            node.annotation = None
        elif isinstance(node, ast.AnnAssign):
            node.annotation = ast.Constant(None)
    return ast.dump(tree)


def main() -> None:
    """Run the sample; exit code 1 where fewer are noticed than `LEAST`."""
    parser = argparse.ArgumentParser("python -m tests.mutants", description=__doc__)
    parser.add_argument("--sample", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    given = parser.parse_args()
    everything = mutants()
    random.Random(given.seed).shuffle(everything)
    chosen = []
    for each in everything:
        if len(chosen) == given.sample:
            break
        if mutated(each) is not None:
            chosen.append(each)
    left = []
    with tempfile.TemporaryDirectory() as folder:
        with closing(in_workers(partial(survives, folder), chosen, max(given.processes, 2))) as results:
            for done, (index, difference) in enumerate(results, 1):
                if difference:
                    left.append((chosen[index], difference))
                    print(f"{chosen[index].file}: {chosen[index].operator}\n{difference}", flush=True)
                if done % 25 == 0:
                    print(f"{done} of {len(chosen)}: {done - len(left)} noticed", file=sys.stderr, flush=True)
    share = 1.0 - len(left) / len(chosen)
    noticed = f"{100.0 * share:.1f} % noticed, {len(left)} not"
    print(f"{len(chosen)} of {len(everything)} mutations, seed {given.seed}: {noticed}")
    sys.exit(share < LEAST)


if __name__ == "__main__":
    main()
