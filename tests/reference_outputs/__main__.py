"""`make reference`: compute every case anew, or those whose name contains a word given, and write what changed."""

import os
import sys
from pathlib import Path

from tests.reference_outputs.tables import load_cases

data = os.environ.get("STEERWAY_DATA")
for name, case in load_cases().items():
    if sys.argv[1:] and not any(word in name for word in sys.argv[1:]):
        continue
    if case.recorded and not data:
        print(f"{name}: left as it is, STEERWAY_DATA is not set")
        continue
    output = case.output(*([Path(data)] if case.recorded else []))
    try:
        case.check(output)
        print(f"{name}: unchanged")
    except (AssertionError, FileNotFoundError) as change:
        case.accept(output)
        print(f"{name}: {change}")
