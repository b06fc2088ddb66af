"""What a user says of the field's magnitude: --magnitude, or --place and --date for the geomagnetic model."""

from dataclasses import replace
from datetime import date
from typing import Annotated

import typer

from barberpole.errors import InputError, must
from barberpole.log import Log
from barberpole.modelfile import ModelFile

MagnitudeOption = Annotated[float | None, typer.Option("--magnitude", help="|B| in µT where the log does not say.")]
PlaceOption = Annotated[
    str | None, typer.Option("--place", help="LAT,LON[,METRES] in degrees: |B| by the geomagnetic model (IGRF).")
]
DateOption = Annotated[str | None, typer.Option("--date", help="YYYY-MM-DD of the log, for --place.")]


def magnitude_ut(log: Log, magnitude: float | None, place: str | None, day: str | None) -> float | None:
    """K in µT as the options say, None without them (thesis 4.8: "from the geomagnetic model").

    Raises InputError for what is no place, date or magnitude, for both, and where the log says the field itself.
    """
    if magnitude is None and place is None:
        if day is not None:
            raise InputError(must("--date", "given with --place", "alone"))
        return None
    if magnitude is not None and place is not None:
        raise InputError(must("the field", "given by --magnitude or by --place", "both"))
    said = [name for name in ("b_ut", "bx_ut") if log.has(name)]
    if said:
        raise InputError(
            must("--magnitude or --place", "given where the log does not say the field", said[0], log.path)
        )
    if magnitude is not None:
        return _positive(magnitude)
    from barberpole.navigation.geomagnetic import geomagnetic_magnitude_ut  # here: the model is slow to load

    lat, lon, metres = _place(place or "")
    return geomagnetic_magnitude_ut(lat, lon, 1e-3 * metres, _date(day))


def with_magnitude(file: ModelFile, known_ut: float | None) -> ModelFile:
    """The model file with that magnitude as its reference."""
    return file if known_ut is None else replace(file, reference={**file.reference, "magnitude_ut": known_ut})


def _positive(magnitude: float) -> float:
    if not 0.0 < magnitude < float("inf"):
        raise InputError(must("--magnitude", "a field in µT above 0", f"{magnitude:g}"))
    return magnitude


def _place(text: str) -> tuple[float, float, float]:
    parts = text.split(",")
    try:
        numbers = [float(part) for part in parts]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3):
        raise InputError(must("--place", "LAT,LON or LAT,LON,METRES", repr(text)))
    return numbers[0], numbers[1], numbers[2] if len(numbers) == 3 else 0.0


def _date(text: str | None) -> date:
    if text is None:
        raise InputError(
            must("--place", "given with the --date of the log (the field drifts by 0.1 % a year)", "alone")
        )
    try:
        return date.fromisoformat(text)
    except ValueError:
        raise InputError(must("--date", "YYYY-MM-DD", repr(text))) from None
