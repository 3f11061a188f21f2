"""The instruments of a scenario in addition to the receiver, by the name of their table.

Append a new one at the end: the position in this table selects an instrument's random stream.
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
