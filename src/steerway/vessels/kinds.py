"""The vessels that a scenario can name in `vessel.kind`. A new one is one entry here; the first is the default."""

from steerway.core.settings import union_by_kind
from steerway.vessels.caldas import CaldasTable
from steerway.vessels.cybership2 import CyberShip2Table
from steerway.vessels.low_speed import LowSpeedTable
from steerway.vessels.mariner import MarinerTable
from steerway.vessels.motorboat import MotorboatTable
from steerway.vessels.nomoto import NomotoTable
from steerway.vessels.otter import OtterTable
from steerway.vessels.springer import SpringerTable
from steerway.vessels.surge import SurgeTable

TABLES = (
    OtterTable,
    MarinerTable,
    NomotoTable,
    SpringerTable,
    CaldasTable,
    SurgeTable,
    MotorboatTable,
    CyberShip2Table,
    LowSpeedTable,
)
AnyVesselTable = union_by_kind(TABLES)
