"""The demo step by step. Everything it says was measured on the way; nothing is typed in."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from barberpole.adding import Change, change
from barberpole.board import load_board
from barberpole.calibrating import calibration_of, with_selfcal
from barberpole.calibration import Calibration, write_calibration
from barberpole.calibration_tables import Step
from barberpole.columns import COMPENSATED, FIELD
from barberpole.demo.bench import TRUE_EFFECTS, Bench, Session, scale_at_reference
from barberpole.diagnose import Comparison, Diagnosis, compare, diagnose
from barberpole.errors import InputError, must
from barberpole.fit.fit import fit_observations
from barberpole.log import Log, write_log
from barberpole.modelfile import ModelFile, add_effect, read_model, write_model
from barberpole.nominal import nominal
from barberpole.observations import observations
from barberpole.verify import Verification, verify

FACTORY_FIELDS = 300
TODAY_FIELDS = 210
ROWS_PER_FIELD = 5
GAIN_DRIFT = (1.0040, 0.9970, 1.0020)  # since the factory: what the power-up run has to find
HIDEABLE = (*TRUE_EFFECTS, "none")


@dataclass(frozen=True)
class Believed:
    """One calibration on the board: what it says, how its power-up went, and its error against the applied field."""

    calibration: Calibration
    session: Session
    verification: Verification
    error_nt: np.ndarray
    gain_error_ppm: tuple[float, float, float]

    @property
    def rms_nt(self) -> float:
        return float(np.sqrt(np.mean(self.error_nt**2)))


@dataclass(frozen=True)
class Outcome:
    """What the demo found. `after` is `before` where nothing was missing."""

    hidden: str
    before: Believed
    after: Believed
    comparison: Comparison
    diagnosis: Diagnosis
    addition: Change | None
    noise_lsb: float

    @property
    def named(self) -> str | None:
        return self.diagnosis.suspects[0].effect if self.diagnosis.suspects else None

    def to_json(self) -> dict:
        """The object of `demo --json`."""
        old, new = self.before.calibration.residual, self.after.calibration.residual
        if self.addition:
            old, new = self.addition.before, self.addition.after
        return {
            "hidden": self.hidden,
            "named": self.named,
            "verdict": self.diagnosis.verdict,
            "rms_before_lsb": old.rms_lsb,
            "rms_after_lsb": new.rms_lsb,
            "heldout_before_lsb": old.heldout_rms_lsb,
            "heldout_after_lsb": new.heldout_rms_lsb,
            "noise_lsb": self.noise_lsb,
            "board_error_before_nt": self.before.rms_nt,
            "board_error_after_nt": self.after.rms_nt,
            "gain_error_ppm": list(self.after.gain_error_ppm),
            "selfcal_s": self.after.session.run.meta["result"]["duration_s"],
            "verified": self.after.verification.passed,
        }


@dataclass(frozen=True)
class Story:
    """The demo on one board with one effect hidden from its model; everything it makes stays in `folder`."""

    board_name: str
    hidden: str
    folder: Path
    seed: int
    chapter: Callable[[str], None]
    say: Callable[[str], None]
    tick: Callable[[int], None]

    def run(self) -> Outcome:
        """From data-sheet values to the board that has learnt what it lacked."""
        bench = Bench(load_board(self.board_name), self.folder, self.seed, self.say)
        self.chapter("1 of 5  factory: flash data-sheet values, apply known fields, fit")
        factory = self._factory_session(bench)
        model = self._first_model(bench)
        first = self._calibrate(bench, factory, model, "calibration-1.toml")
        self.chapter("2 of 5  power-up: the board calibrates itself and the host checks it")
        before = self._believe(bench, first, "before")
        self.chapter("3 of 5  compare the model with the measurement; which effect is missing?")
        log, sensor = before.session.log, bench.board.sensor
        fit = fit_observations(observations(log, sensor), model)
        comparison, diagnosis = compare(fit), diagnose(log, model, sensor=sensor)
        self.say(f"verdict: {diagnosis.verdict} {' '.join(s.effect for s in diagnosis.suspects)}")
        noise = float(np.sqrt(np.mean(np.square(before.session.truth["noise_lsb"]))))
        if not diagnosis.suspects:
            return Outcome(self.hidden, before, before, comparison, diagnosis, None, noise)
        self.chapter(f"4 of 5  add {diagnosis.suspects[0].effect} and fit again")
        found, second = self._add(bench, factory, before, diagnosis.suspects[0].effect)
        self.chapter("5 of 5  rebuild, flash, power cycle: the error falls")
        after = self._believe(bench, second, "after")
        return Outcome(self.hidden, before, after, comparison, diagnosis, found, noise)

    def _factory_session(self, bench: Bench) -> Session:
        with bench.on(bench.station(FACTORY_FIELDS)) as twin:
            bench.deploy(twin, nominal(bench.board), "build-0")
            session = bench.power_up(twin, "factory", FACTORY_FIELDS * ROWS_PER_FIELD, self.tick)
        write_log(session.log, self.folder / "factory.csv")
        return session

    def _first_model(self, bench: Bench) -> ModelFile:
        kept = ("bias", "scale", *(name for name in TRUE_EFFECTS if name != self.hidden))
        path = self.folder / "model-1.toml"
        write_model(ModelFile(kept, sensor=bench.board.sensor.name), path)
        return read_model(path)

    def _calibrate(
        self, bench: Bench, factory: Session, model: ModelFile, name: str, history: tuple[Step, ...] = ()
    ) -> Calibration:
        """Fit the factory log and take the factory's coil run as reference for later power-ups."""
        fit = fit_observations(observations(factory.log, bench.board.sensor), model)
        step = Step(
            rms_lsb=fit.rms_lsb,
            heldout_rms_lsb=fit.heldout_rms_lsb,
            added=model.effects[-1] if history else None,
        )
        calibration = calibration_of(fit, factory.log, model, history=(*history, step))
        coils = factory.run.selfcal
        if coils is None:
            raise InputError(must("the factory's power-up", "one with a coil run", "none", self.folder))
        calibration = with_selfcal(calibration, coils, bench.board.sensor)
        write_calibration(calibration, self.folder / name)
        self.say(f"residual {fit.rms_lsb:.4g} LSB over {fit.problem.n} readings")
        return calibration

    def _believe(self, bench: Bench, calibration: Calibration, name: str) -> Believed:
        """Flash a calibration, power cycle months later, and check what the board makes of itself."""
        with bench.on(bench.station(TODAY_FIELDS, gain_drift=GAIN_DRIFT)) as twin:
            bench.deploy(twin, calibration, f"build-{name}")
            session = bench.power_up(twin, name, TODAY_FIELDS * ROWS_PER_FIELD, self.tick)
        write_log(session.log, self.folder / f"{name}.csv")
        verification = verify(session.run, calibration)
        for check in verification.checks:
            self.say(check.sentence)
        return Believed(calibration, session, verification, _error_nt(session.log), _gain_error(session, calibration))

    def _add(self, bench: Bench, factory: Session, before: Believed, effect: str) -> tuple[Change, Calibration]:
        """What `barberpole add` does, then the factory log once more under the larger model."""
        old = read_model(self.folder / "model-1.toml")
        seen = observations(before.session.log, bench.board.sensor)
        found = change(seen, old, add_effect(old, effect), effect)
        write_model(found.after_file, self.folder / "model-2.toml")
        second = self._calibrate(bench, factory, found.after_file, "calibration-2.toml", before.calibration.history)
        return found, second


def _error_nt(log: Log) -> np.ndarray:
    """(3, n) nT: the field that the board computed less the field that was applied."""
    board, applied = log.stack(COMPENSATED), log.stack(FIELD)
    if board is None or applied is None:
        raise InputError(must("the log", "one with compensated and applied field", "one without", log.path))
    return 1000.0 * (board - applied)


def _gain_error(session: Session, calibration: Calibration) -> tuple[float, float, float]:
    """ppm by axis: the gain that the board believes in after its power-up, over the true one."""
    factory = np.array([calibration.parameters[f"scale.{axis}"].value for axis in "xyz"])
    today = np.asarray(session.run.meta["result"]["in_force_gain"])
    x, y, z = 1e6 * (factory * today / scale_at_reference(session.truth, calibration.t0_c) - 1.0)
    return float(x), float(y), float(z)
