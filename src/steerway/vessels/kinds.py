"""The vessels that a scenario can name in `vessel.kind`. A new one is one entry here; the first is the default."""

from steerway.core.schema import one_of_kinds
from steerway.vessels.mariner import MarinerTable
from steerway.vessels.nomoto import NomotoTable
from steerway.vessels.otter import OtterTable

TABLES = (OtterTable, MarinerTable, NomotoTable)
AnyVesselTable = one_of_kinds(TABLES)
