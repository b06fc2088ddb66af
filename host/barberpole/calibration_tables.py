"""The tables of a calibration file, apart from its parameters."""

from typing import Annotated, Any

from pydantic import Strict
from pydantic.dataclasses import dataclass

from barberpole.tables import STRICT

Real = Annotated[float, Strict()]  # NaN and infinity are answers here: "not known", "not bounded"
Triple = tuple[Real, Real, Real]
Matrix = tuple[Triple, Triple, Triple]


@dataclass(frozen=True, config=STRICT)
class Value:
    """A fitted parameter with its standard error, both in `unit`."""

    value: Real
    stderr: Real
    unit: str


@dataclass(frozen=True, config=STRICT)
class Residual:
    """What the model leaves of the n readings it was fitted to."""

    n: int
    rms_lsb: Real
    """LSB. Over all residuals."""
    rms_ut: Real | None = None
    """µT. Of the calibrated field, where a field is known."""
    noise_lsb: Real | None = None
    """LSB. White noise of the readings."""
    heldout_rms_lsb: Real | None = None
    """LSB. On stretches fitted without them."""
    rms_norm_percent: Real | None = None
    """Per cent. RMS of |B|/K - 1, for scalar references."""


@dataclass(frozen=True, config=STRICT)
class Validity:
    """The fields and temperatures that the log has seen; outside, the calibration extrapolates."""

    field_min_ut: Triple | None = None
    """µT. Smallest field per axis."""
    field_max_ut: Triple | None = None
    """µT. Largest field per axis."""
    b_max_ut: Real | None = None
    """µT. Largest magnitude."""
    temp_min_c: Real | None = None
    """°C. Lowest temperature."""
    temp_max_c: Real | None = None
    """°C. Highest temperature."""


@dataclass(frozen=True, config=STRICT)
class Step:
    """An effect that was added or removed, and the error after it."""

    rms_lsb: Real
    heldout_rms_lsb: Real | None = None
    added: str | None = None
    removed: str | None = None


@dataclass(frozen=True, config=STRICT)
class SelfcalReference:
    """The coils' response when the calibration was made: what later power-ups are compared with (thesis 6.7)."""

    gain_ut_per_unit: Matrix
    """µT per trajectory unit. Row: axis that reads, column: coil that is driven."""
    units_ma: Triple
    """mA. Current of one trajectory unit, per coil."""
    trajectory: str
    """Id of the trajectory."""
    offset_lsb: Triple
    """LSB. Electronic offset, half of SET + RESET."""
    temp_c: Real
    """°C. Temperature of the run."""


@dataclass(frozen=True, config=STRICT)
class PriorTable:
    """The lot whose distribution stood beside the log in the fit."""

    source: str
    """Name of the fleet's file."""
    sha256: str
    """Hash of the fleet's file."""
    boards: int
    """How many boards it was taken from."""
    mean: dict[str, Real]
    """The lot's mean of each parameter."""
    width: dict[str, Real]
    """Standard deviation of a further board's value."""
    lot: str | None = None
    """Name of the lot, where the fleet holds several."""


@dataclass(frozen=True, config=STRICT)
class ModelTable:
    """The model file's content, plugins named relative to the calibration file."""

    effects: tuple[str, ...]
    settings: dict[str, dict[str, Any]]
    reference: dict[str, Any]
    plugins: tuple[str, ...]
    sensor: str | None = None


@dataclass(frozen=True, config=STRICT)
class LogTable:
    """The log it was fitted to."""

    name: str
    sha256: str


@dataclass(frozen=True, config=STRICT)
class CovarianceTable:
    """Rows and columns in the order of the parameters."""

    matrix: tuple[tuple[Real, ...], ...]


@dataclass(frozen=True, config=STRICT)
class CalibrationTables:
    """The whole file; `barberpole.calibration.Calibration` is what it means."""

    format: int
    method: str
    t0_c: Real
    easy_axis: tuple[int, int, int]
    unobservable: tuple[str, ...]
    model: ModelTable
    log: LogTable
    residual: Residual
    validity: Validity
    parameters: dict[str, dict[str, Value]]
    covariance: CovarianceTable
    selfcal: SelfcalReference | None = None
    prior: PriorTable | None = None
    history: tuple[Step, ...] = ()
