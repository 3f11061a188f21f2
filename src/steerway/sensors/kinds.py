"""The instruments that a scenario can fit beside the receiver, by the name of their table.

A new one is one entry at the end: each draws from a random stream of its place here.
"""

from steerway.sensors.compass import CompassTable
from steerway.sensors.doppler import BottomLogTable, LogTable, TachometerTable
from steerway.sensors.inertial import AccelerometerTable, GyroTable
from steerway.sensors.instrument import InstrumentTable

INSTRUMENTS: dict[str, type[InstrumentTable]] = {
    "compass": CompassTable,
    "gyro": GyroTable,
    "log": LogTable,
    "accelerometer": AccelerometerTable,
    "bottom_log": BottomLogTable,
    "tachometer": TachometerTable,
}
