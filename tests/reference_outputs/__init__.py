"""Reference outputs: what every estimator, law and study returned on generated input when this was last accepted.

A case is a function under `cases/` marked `@case`; it returns named columns. `make reference` writes each to
`files/NAME.csv`; `test_reference_outputs.py` compares. A change of numbers is then a line in a diff.
"""
