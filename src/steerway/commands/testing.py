"""Names for this package's tests; not part of the public API."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.commands import cli, interruption, study, terminal
    from steerway.commands.app import app, command_tree
    from steerway.commands.demo import SCENARIO, simulate_demo
    from steerway.commands.schema import KINDS, schema_of
    from steerway.commands.study import GROUP

__getattr__, __dir__ = on_demand(__name__)
