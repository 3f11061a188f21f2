"""The tables [estimator.heading] and [estimator.speed], of scenarios and of the settings of `steerway live`."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from steerway.core.settings import NotNegative, Positive, Table


class HeadingEstimatorTable(Table):
    """The filter of the heading. "tracker": compass, smoothed. "composite": compass and orders. "aided": orders, GNSS
    velocity and, if on board, the compass. "interval": the lowest and the highest heading over all deviations within
    ± 2 `deviation_std_deg`; the heading used is lowest + `weight` × (highest − lowest).
    """

    kind: Literal["tracker", "aided", "composite", "interval"] = "tracker"
    """Filter of the heading; the filters differ in the measurements that they use."""
    compass_std_deg: Positive = 1.0
    """1σ of the noise of a compass reading."""
    deviation_std_deg: NotNegative = 4.0
    """1σ of the compass deviation."""
    weight: Annotated[float, Field(strict=True, ge=0.0, le=1.0), "1"] = 0.5
    """Weight of the highest heading in the interval from lowest to highest."""

    @model_validator(mode="after")
    def _used(self) -> Self:
        if self.kind == "tracker":
            refuse(self, self.model_fields_set, "a filter of the heading")
        if self.kind != "interval":
            refuse(self, self.model_fields_set & {"weight"}, "interval")
        return self


class SpeedEstimatorTable(Table):
    """The source of the speed. "course": the course filter; "fusion": receiver, logs and accelerometer combined."""

    kind: Literal["course", "fusion"] = "course"
    """Source of the speed: the filter of the course, or a combination of receiver, logs and accelerometer."""
    sog_std: Annotated[Positive, "m/s"] = 0.05
    """1σ of a SOG reading of the receiver. The default on board is 0.1."""
    bottom_std: Annotated[Positive, "m/s"] = 0.002
    """1σ of a reading of speed over ground by a Doppler log. The default on board is 0.02."""
    water_std: Annotated[Positive, "m/s"] = 0.05
    """1σ of a reading of speed through the water."""
    scale_std: Annotated[NotNegative, "1"] = 0.003
    """1σ of the scale error of the speed log."""

    @model_validator(mode="after")
    def _used(self) -> Self:
        if self.kind == "course":
            refuse(self, self.model_fields_set, "fusion")
        return self


def refuse(table: HeadingEstimatorTable | SpeedEstimatorTable, keys: set[str], kind: str) -> None:
    """Raise ValueError for a key beside `kind` that has no effect."""
    for key in sorted(keys - {"kind"}):
        raise ValueError(f'{key} has no effect with kind "{table.kind}", expected {kind}')


class EstimatorSettings(Table):
    """Estimators beside the filter of the course."""

    heading: HeadingEstimatorTable = HeadingEstimatorTable()
    """Filter of the heading."""
    speed: SpeedEstimatorTable = SpeedEstimatorTable()
    """Filter of the speed."""
