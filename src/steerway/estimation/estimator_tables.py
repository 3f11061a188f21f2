"""The tables [estimator.heading] and [estimator.speed], of scenarios and of the settings of `steerway live`."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from steerway.core.settings import NotNegative, Positive, Table


class HeadingEstimatorTable(Table):
    """The filter of the heading. "tracker": compass, smoothed; "composite": compass and orders; "aided": orders, GNSS
    velocity and, if on board, the compass.

    "interval": the lowest and the highest heading over all deviations within ± 2 `deviation_std_deg`; the heading used
    is lowest + `weight` × (highest − lowest). `compass_std_deg`: 1σ of one reading; `deviation_std_deg`: 1σ of the
    deviation.
    """

    kind: Literal["tracker", "aided", "composite", "interval"] = "tracker"
    compass_std_deg: Positive = 1.0
    deviation_std_deg: NotNegative = 4.0
    weight: Annotated[float, Field(strict=True, ge=0.0, le=1.0), "1"] = 0.5

    @model_validator(mode="after")
    def _used(self) -> Self:
        if self.kind == "tracker":
            refuse(self, self.model_fields_set, "a filter of the heading")
        if self.kind != "interval":
            refuse(self, self.model_fields_set & {"weight"}, "interval")
        return self


class SpeedEstimatorTable(Table):
    """The source of the speed. "course": the course filter; "fusion": receiver, logs and accelerometer combined.

    `sog_std`, `bottom_std`, `water_std`: 1σ of one reading of the receiver's speed and of the logs; on board their
    defaults are 0.1, 0.02 and 0.05 m/s. `scale_std`: 1σ of the log's scale error.
    """

    kind: Literal["course", "fusion"] = "course"
    sog_std: Annotated[Positive, "m/s"] = 0.05
    bottom_std: Annotated[Positive, "m/s"] = 0.002
    water_std: Annotated[Positive, "m/s"] = 0.05
    scale_std: Annotated[NotNegative, "1"] = 0.003

    @model_validator(mode="after")
    def _used(self) -> Self:
        if self.kind == "course":
            refuse(self, self.model_fields_set, "fusion")
        return self


def refuse(table: HeadingEstimatorTable | SpeedEstimatorTable, keys: set[str], kind: str) -> None:
    """Raise ValueError for a key beside `kind` that has no effect."""
    for key in sorted(keys - {"kind"}):
        raise ValueError(f'{key} has no effect with kind "{table.kind}", expected {kind}')
