"""The tables [estimator.heading] and [estimator.speed], of scenarios and of the settings of `steerway live`."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from steerway.core.settings import NotNegative, Positive, Table


class HeadingEstimatorTable(Table):
    """Source of the heading: "tracker" smooths a compass, "composite" adds the orders, "aided" also GNSS velocity.

    "interval" bounds the heading for all deviations within two `deviation_std_deg`; `weight` selects the heading
    between the bounds. `compass_std_deg` is 1σ of one reading, `deviation_std_deg` 1σ of the compass's deviation.
    """

    kind: Literal["tracker", "aided", "composite", "interval"] = "tracker"
    compass_std_deg: Positive = 1.0
    deviation_std_deg: NotNegative = 4.0
    weight: Annotated[float, Field(strict=True, ge=0.0, le=1.0), "1"] = 0.5

    @model_validator(mode="after")
    def _used(self) -> Self:
        if self.kind == "tracker":
            refuse(self, "heading", self.model_fields_set, "a filter of the heading")
        if self.kind != "interval":
            refuse(self, "heading", self.model_fields_set & {"weight"}, "interval")
        return self


class SpeedEstimatorTable(Table):
    """Source of the speed: "course" is the course filter, "fusion" combines receiver, logs and accelerometer.

    1σ of one reading of the receiver's speed and of the logs, m/s; `scale_std` of the log's scale error. In live runs
    the defaults are 0.1, 0.02 and 0.05 m/s.
    """

    kind: Literal["course", "fusion"] = "course"
    sog_std: Annotated[Positive, "m/s"] = 0.05
    bottom_std: Annotated[Positive, "m/s"] = 0.002
    water_std: Annotated[Positive, "m/s"] = 0.05
    scale_std: Annotated[NotNegative, "1"] = 0.003

    @model_validator(mode="after")
    def _used(self) -> Self:
        if self.kind == "course":
            refuse(self, "speed", self.model_fields_set, "fusion")
        return self


def refuse(table: HeadingEstimatorTable | SpeedEstimatorTable, name: str, keys: set[str], kind: str) -> None:
    """Raise ValueError for a key beside `kind` that has no effect."""
    for key in sorted(keys - {"kind"}):
        raise ValueError(f'estimator.{name}.{key} has no effect with kind "{table.kind}", expected {kind}')
