"""python -m tests.faults: measures every fault and rewrites the table of docs/service.md."""

from tests.faults.measured import measure
from tests.faults.sorties import FAULTS
from tests.faults.table import line, written

if __name__ == "__main__":
    lines = []
    for fault in FAULTS:
        lines.append(line(fault, measure(fault)))
        print(lines[-1], flush=True)
    written(lines)
