"""The table [sensor] of boards/sensors/<sensor>.toml.

The docstring under each field gives its unit and meaning; `make docs` prints them.
"""

from typing import Literal

from pydantic.dataclasses import dataclass

from barberpole.tables import STRICT, Count, Name, NotNegative, Number, Positive

Axis = Literal["x", "y", "z"]
Axes = tuple[Axis, Axis, Axis]
PerAxis = tuple[Positive, Positive, Positive]


Pair = tuple[Number, Number]


@dataclass(frozen=True, config=STRICT)
class Digital:
    """A sensor with its converter on the chip, as calibrated at its finest range (form of the article's table 1)."""

    rate_hz: Positive
    """Hz. Rate of the readings."""
    sensitivity_nt_per_lsb: PerAxis
    """nT/LSB. Mean linear sensitivity."""
    sensitivity_range_nt_per_lsb: tuple[NotNegative, NotNegative, NotNegative]
    """nT/LSB. Half the range of the sensitivity over sensors of the kind."""
    misalignment_deg: tuple[NotNegative, NotNegative]
    """°. Angle between axes less 90°: median and maximum over sensors."""
    noise_nt: PerAxis
    """nT. Mean standard deviation of the noise."""
    noise_at_1_hz_nt_per_rthz: PerAxis
    """nT/√Hz. Mean noise density at 1 Hz."""
    offset_nt: Pair
    """nT. Smallest and largest offset over axes and sensors."""
    sensitivity_drift_25c_pt_per_lsb_per_c: Pair
    """pT/LSB/°C. Drift of the sensitivity at 25 °C: middle and half the range."""
    sensitivity_drift_formula: Pair
    """pT/LSB/°C. The mean drift is first x T + second, T in °C."""
    offset_drift_nt_per_c: Pair
    """nT/°C. Drift of the offset: middle and half the range."""
    offset_drift_max_nt_per_c: Positive
    """nT/°C. Largest magnitude of the drift of the offset."""
    polynomial_degrees: tuple[Count, Count]
    """Degrees m (on-axis) and n (cross-field) that sufficed for the polynomial calibration."""


@dataclass(frozen=True, config=STRICT)
class Sensor:
    """One family of AMR sensors: three bridges with their coils."""

    name: Name
    """Name of the file without .toml."""
    technology: str
    """What kind of element it is, in words."""
    axes: Axes
    """Names of the three bridges."""
    easy_axis: Axes
    """The axis along the easy axis of the x, y and z bridge: the direction of its cross field."""
    range_ut: Positive
    """µT. Largest field per axis that the bridge is specified for."""
    sensitivity_mv_per_v_per_ut: Positive
    """mV/V/µT. Bridge output over bridge voltage, per field."""
    bridge_ohm: Positive
    """Ω. Resistance of one bridge at 25 °C."""
    bridge_ma: Positive
    """mA. Current that feeds one bridge."""
    offset_mv_per_v: Number
    """mV/V. Typical bridge offset, constant in SET and RESET."""
    bridge_tempco_per_c: Number
    """1/°C. Relative change of the bridge resistance: the bridge voltage is the thermometer."""
    sensitivity_tempco_per_c: Number
    """1/°C. Relative change of the sensitivity on a constant current."""
    anisotropy_field_ut: PerAxis
    """µT. Anisotropy field H_k of each bridge."""
    noise_nt_per_rthz: NotNegative
    """nT/√Hz. White noise density of bridge and amplifier."""
    corner_hz: NotNegative
    """Hz. Below it 1/f noise exceeds the white noise."""
    offset_coil_ut_per_ma: Positive
    """µT/mA. Field of the offset coil at its own bridge."""
    offset_coil_ohm: Positive
    """Ω. Resistance of one offset coil."""
    offset_coil_max_ma: Positive
    """mA. Largest steady current of one offset coil."""
    strap_ohm: Positive
    """Ω. Resistance of one set/reset strap."""
    strap_current_a: Positive
    """A. Smallest pulse that aligns all domains."""
    strap_pulse_us_min: Positive
    """µs. Shortest pulse that aligns all domains."""
    digital: Digital | None = None
    """Figures of a sensor with its converter on the chip."""

    @property
    def easy_axis_index(self) -> tuple[int, int, int]:
        """`easy_axis` as component numbers: (1, 0, 1) is y, x, y."""
        x, y, z = (self.axes.index(axis) for axis in self.easy_axis)
        return x, y, z

    @property
    def bridge_v(self) -> float:
        """V. Voltage over one bridge at 25 °C."""
        return self.bridge_ma * self.bridge_ohm / 1000.0
