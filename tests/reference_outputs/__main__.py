"""`make reference`: compute every case anew, or those whose name contains a word given, and write what changed."""

import os
import sys
from pathlib import Path

from tests.reference_outputs.tables import FILES, differences, load_cases

FILES.mkdir(exist_ok=True)
data = os.environ.get("STEERWAY_DATA")
for name, case in load_cases().items():
    if sys.argv[1:] and not any(word in name for word in sys.argv[1:]):
        continue
    if case.recorded and not data:
        print(f"{name}: left as it is, STEERWAY_DATA is not set")
        continue
    output = case.output(*([Path(data)] if case.recorded else []))
    changes = differences(case, output, case.accepted()) if case.path.exists() else ["new"]
    if changes:
        case.accept(output)
    for line in changes or ["unchanged"]:
        print(f"{name}: {line}")
