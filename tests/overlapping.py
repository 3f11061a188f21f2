"""How `make test` hands files to processes: those that wait for clocks go on beside those that compute.

There is one process more than processors. It takes the files whose tests wait: for boats at their true pace, servers,
a browser. The others give way to it, and take what it has left once nothing else is to be done.
"""

import os
from pathlib import PurePosixPath

from xdist.scheduler import LoadFileScheduling

WAITING = (
    "test_live_helm_places", "test_live_opening", "test_processes", "test_accessibility", "test_live_full_disk",
    "test_live_foxglove", "test_live_n2k", "test_live_helm", "test_simulated_live",
    "test_live_parts", "test_live_helm_browser", "test_soak", "test_square_live",
)  # fmt: skip
"""Files that wait more than they compute. What needs most kernels is last: the others have compiled them by then."""

_WAITER = "gw0"


def processors() -> int:
    """How many of them this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def give_way(worker, workers) -> None:
    """Let the process that waits come first, in a worker that computes."""
    if workers > processors() and worker != _WAITER and hasattr(os, "nice"):
        os.nice(10)


def waits(file) -> bool:
    return PurePosixPath(file).stem in WAITING


class Overlapping(LoadFileScheduling):
    """Whole files, in their order; those that wait to the worker that waits."""

    def _reschedule(self, node):
        if self._is_waiter(node) and not any(map(waits, self.workqueue)):
            if not node.shutting_down:
                node.shutdown()
            return
        super()._reschedule(node)

    def _assign_work_unit(self, node):
        wanted = self._is_waiter(node)
        chosen = min(self.workqueue, key=lambda file: waits(file) != wanted)
        self.workqueue.move_to_end(chosen, last=False)
        super()._assign_work_unit(node)

    def _is_waiter(self, node):
        return self.numnodes > processors() and node.gateway.id == _WAITER
