"""Every estimator, law and study returns what was accepted last, at 1e-9; the first column that differs is named."""

import pytest

from tests.reference_outputs.tables import load_cases


@pytest.mark.parametrize("case", load_cases().values(), ids=lambda case: case.name)
def test_output_is_as_accepted(case, request):
    """Accept a change with `make reference ONLY=` and the name of the case."""
    case.check(case.output(*([request.getfixturevalue("shared_data")] if case.recorded else [])))
