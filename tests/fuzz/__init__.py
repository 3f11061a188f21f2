"""Fuzzing for long: `python -m tests.fuzz --minutes 15`.

Mutations of generated and recorded inputs go to everything that reads what others wrote. An input that leads to an
outcome not seen before joins the corpus, which is kept outside of the repository. Findings become tests
(`tests/test_fuzz_findings.py`).
"""
