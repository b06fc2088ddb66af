"""Fig. 6.26 on the emulated board: the same sensor calibrates itself again and again in its shield.

`python -m barberpole.reproduce.repeatability [POWER_UPS]` prints the table. Each power-up is the whole one: firmware as
built, coils driven through the converters, bridges with the noise of the sensor file, fit on the board. As in fig. 6.26
A and B of H = A h + B are those of the coil run, here with the mean A of all runs as the unit:

    A_k = G G_k^-1,   B_k = -c_k,   G the mean of the G_k

G_k and c_k are response and constant of run k (`gain_ut_per_unit`, `ambient_ut`).
"""

import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from barberpole.board import Board, load_board
from barberpole.errors import PortError, must
from barberpole.nominal import nominal
from barberpole.records import RESULT, decode
from barberpole.reproduce.row import Row
from barberpole.twin.ambient import Fixed
from barberpole.twin.api import Twin
from barberpole.twin.temperature import Constant
from barberpole.twin.world import World
from barberpole.units import gauss_to_ut

POWER_UPS = 20
SCALE_PPM, BIAS_PPM = 30.0, 5.0  # 6.2.2.2
SHIELDED_C = 32.0  # 6.2.2.2: the temperature at which the ten runs were made
PATIENCE_S = 30.0
ELEMENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # those of fig. 6.26, in its order


@dataclass(frozen=True)
class Repeats:
    """k power-ups: a (k, 3, 3) over their mean, b_ut (k, 3) in µT, seconds of board time that a run took."""

    a: np.ndarray
    b_ut: np.ndarray
    seconds: float

    def ranges_ppm(self) -> dict[str, float]:
        """Largest less smallest: of a in ppm, of b in ppm of a gauss, as 6.2.2.2 gives them."""
        found = {f"a_{i + 1}{j + 1}": 1e6 * float(np.ptp(self.a[:, i, j])) for i, j in ELEMENTS}
        return found | {f"b_{i + 1}1": 1e6 * float(np.ptp(self.b_ut[:, i])) / gauss_to_ut(1.0) for i in range(3)}


def repeats(power_ups: int = POWER_UPS) -> Repeats:
    """So many self-calibrations of one board at 32 °C in a shield. Raises PortError where one does not come."""
    from barberpole_codegen.build import build  # here: the page needs it once, and the commands never

    board = replace(load_board("pybv11"), shielded=True)
    world = World.of(board, ("none",), ambient=Fixed((0.0, 0.0, 0.0)), temperature=Constant(SHIELDED_C))
    with tempfile.TemporaryDirectory(prefix="barberpole-repeats-") as folder:
        built = build(board, nominal(board), Path(folder) / "build")
        files = {f"/{target}": built.folder / source for source, target in built.files.items()}
        with Twin(board, folder, world, files=files) as twin:
            results = [_power_up(twin, seed) for seed in range(power_ups)]
    response = np.array([r["gain_ut_per_unit"] for r in results])
    a = np.mean(response, axis=0) @ np.linalg.inv(response)
    return Repeats(a, -np.array([r["ambient_ut"] for r in results]), results[0]["duration_s"])


def expected_ppm(board: Board, power_ups: int) -> float:
    """Range in ppm of a gain over so many runs that the noise of the sensor file alone makes, of axes alike.

    A point averages two half cycles times cycles_per_point; a gain over n points has sigma / sqrt(sum B_i²), B_i the
    coil's field.
    """
    run, adc = board.selfcal, board.adc
    seconds = 2.0 * run.cycles_per_point * adc.samples_per_half / adc.sample_hz
    sigma_ut = 1e-3 * board.sensor.noise_nt_per_rthz / np.sqrt(2.0 * seconds)
    squares = run.points * float(np.mean(np.square(run.radii_ut))) / 3.0
    return float(1e6 * sigma_ut / np.sqrt(squares) * mean_range(power_ups))


def mean_range(count: int) -> float:
    """Mean of largest less smallest of so many normal numbers, in standard deviations."""
    return float(np.mean(np.ptp(np.random.default_rng(0).normal(size=(4000, count)), axis=1)))


def rows(power_ups: int = POWER_UPS) -> list[Row]:
    """Fig. 6.26 once more, by the emulated board; where 6.2.2.2 prints a figure it is the largest of its kind."""
    found, expected = repeats(power_ups), expected_ppm(load_board("pybv11"), power_ups)
    ranges = found.ranges_ppm()
    largest = {kind: max(v for name, v in ranges.items() if name.startswith(kind)) for kind in ("a", "b")}
    how = f"{power_ups} power-ups of {found.seconds:.2f} s, emulated"
    bound = (
        f"“less than”; the noise of the sensor file alone makes {expected:.0f} ppm of it, in runs of "
        f"{found.seconds:.2f} s; the thesis does not print how long its runs were"
    )
    ten = mean_range(10) / mean_range(power_ups)
    what = {name: f"largest less smallest {name}, {how}" for name in ranges}
    return [
        *(Row("thesis", "fig. 6.26", what[name], None, ppm, "ppm") for name, ppm in ranges.items()),
        Row("thesis", "6.2.2.2", f"variation of the scale factor, {how}", SCALE_PPM, largest["a"], "ppm", bound),
        Row("thesis", "6.2.2.2", f"variation of the bias, {how}", BIAS_PPM, largest["b"], "ppm",
            f"of a gauss; ten runs, as in fig. 6.26, would range over {largest['b'] * ten:.1f} ppm by the same noise"),
    ]  # fmt: skip


def _power_up(twin: Twin, seed: int) -> dict:
    said = len(twin.log_text)
    twin.power_cycle(seed=seed)
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        found = [f.json for f in decode(twin.log_text[said:].encode()).frames if f.type == RESULT and f.json]
        if found and "gain_ut_per_unit" in found[0]:
            return found[0]
        time.sleep(0.02)
    raise PortError(must("the emulated board", "through its self-calibration", "no result", twin.port))


def main() -> None:
    """Print the table."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else POWER_UPS
    found = repeats(count)
    print(f"{count} power-ups of {found.seconds:.2f} s; largest less smallest, ppm (biases: of a gauss)")
    for name, ppm in found.ranges_ppm().items():
        print(f"{name}  {ppm:6.1f}")


if __name__ == "__main__":
    main()
