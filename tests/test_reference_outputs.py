"""Every estimator, law and study returns what was accepted last, at 1e-9; a change is named column by column."""

import numpy as np
import pytest

from tests.reference_outputs.tables import Case, differences, load_cases


@pytest.mark.parametrize("case", load_cases().values(), ids=lambda case: case.name)
def test_output_is_as_accepted(case, request):
    arguments = [request.getfixturevalue("shared_data")] if case.recorded else []
    changes = differences(case, case.output(*arguments), case.accepted())
    assert not changes, "\n".join(["", *changes, f"accept with: make reference ONLY={case.name}"])


def test_differences_name_column_row_and_size():
    case = Case("any", dict)
    old = {"sog": np.array([1.0, 2.0, np.nan]), "cog": np.zeros(3)}
    assert differences(case, old, old) == []
    assert differences(case, {**old, "sog": np.array([1.0, 2.0 + 1e-6, np.nan])}, old)[0].startswith(
        "sog: 1 of 3 rows changed, from row 1 on; most at row 1"
    )
    assert "column is gone" in differences(case, {"sog": old["sog"]}, old)[0]
    assert differences(case, {**old, "sog": np.array([1.0, 2.0, 3.0])}, old)


def test_differences_of_a_text_are_a_diff():
    case = Case("any", str, text=True)
    assert differences(case, "one\ntwo\n", "one\ntwo\n") == []
    assert differences(case, "one\nthree\n", "one\ntwo\n")[-2:] == ["-two", "+three"]
