"""python -m tests.faults: measures every fault and writes the tables of docs/live.md anew."""

from tests.faults import aboard
from tests.faults.measured import measure
from tests.faults.sorties import FAULTS
from tests.faults.table import ABOARD, ABOARD_END, ABOARD_HEAD, line, written

if __name__ == "__main__":
    lines = []
    for fault in FAULTS:
        lines.append(line(fault, measure(fault)))
        print(lines[-1], flush=True)
    written(lines)
    lines = [f"| {name} | {happens()} |" for name, happens in aboard.FAULTS.items()]
    print("\n".join(lines))
    written(lines, ABOARD, ABOARD_END, ABOARD_HEAD)
