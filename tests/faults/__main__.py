"""`python -m tests.faults [MODULE]` measures the faults of commands, service and stops, or of one of these modules."""

import sys

from tests.faults import commands, service, stops

if __name__ == "__main__":
    for module in (service, commands, stops):
        if module.__name__.rpartition(".")[2] in (sys.argv[1:] or module.__name__):
            module.TABLE.write(module.line(name, module.measured(name)) for name in module.FAULTS)
