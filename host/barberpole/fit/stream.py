"""Fits of logs too long for memory: the same normal equations, added up piece by piece, as many passes as steps.

A sample of the log (`LogStream.sample`) is fitted first; the passes over the whole log start from there.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from barberpole.effects import Effect, find_effect
from barberpole.errors import InputError, must
from barberpole.fit.fit import Fit, determined, fit_observations
from barberpole.fit.gram import Gram, Tick, block_edges, empty
from barberpole.fit.residual import Problem
from barberpole.fit.whole import figures
from barberpole.log import Log
from barberpole.log_stream import LogStream
from barberpole.model import Model
from barberpole.modelfile import ModelFile
from barberpole.observations import Observations, as_told, observations
from barberpole.sensor import Sensor

IN_MEMORY = 10_000_000  # rows: what a model with memory may take


@dataclass(frozen=True)
class Streamed:
    """A model held against a log on disk. `like` is the problem of the sample: every piece is seen as it is."""

    stream: LogStream
    like: Problem
    sensor: Sensor | None = None

    @property
    def model(self) -> Model:
        return self.like.model

    @property
    def vector(self) -> bool:
        return self.like.vector

    def straight(self, rms: float) -> float:
        """Steps are followed to the end, whatever the noise."""
        return 0.0

    @property
    def n(self) -> int:
        """Samples: two a row where SET and RESET came in pairs."""
        seen = self.like.seen
        return self.stream.rows * (seen.y.shape[1] // max(self.stream.sample.n, 1))

    @property
    def largest(self) -> float:
        return self.stream.largest

    def gram(self, p: np.ndarray, sigma: float = 0.0, tick: Tick = None) -> Gram:
        """One pass over the log at parameters p."""
        gram, edges, before = empty(len(p), not self.vector), block_edges(self.n), 0
        for problem in self.problems():
            problem.add_to(gram, p, edges, before)
            before += problem.n
            if tick:
                tick(problem.n)
        return gram.at_noise(sigma)

    def problems(self, tick: Tick = None) -> Iterator[Problem]:
        """The log piece by piece."""
        seen = self.like.seen
        for columns in self.stream.pieces():
            piece = observations(Log(columns, self.stream.path, ""), self.sensor, seen.raw_polarity)
            piece = as_told(piece, seen.reference)
            at = replace(piece.at, t0_c=seen.at.t0_c, t0_s=seen.at.t0_s, gain=seen.at.gain, easy_axis=seen.at.easy_axis)
            at = replace(at, raw_polarity=seen.at.raw_polarity)
            yield replace(self.like, seen=replace(piece, at=at), moments=None)
            if tick:
                tick(piece.y.shape[1])


def fit_stream(
    stream: LogStream, file: ModelFile, sensor: Sensor | None = None, extra: Sequence[Effect] = (), tick: Tick = None
) -> Fit:
    """Fit the effects of a model file to a log on disk, in memory that does not grow with it.

    Raises InputError as `fit_observations`, and where an effect needs the log in one piece.
    """
    if why := in_one_piece(stream, file, extra):
        raise InputError(must("the log", f"read whole for {why}, which need it in one piece", "pieces", stream.path))
    first = fit_observations(with_duration(observations(stream.sample, sensor), stream), file, extra)
    whole = Streamed(stream, first.problem, sensor)
    fitted = np.ones(len(first.p), bool)
    solution = determined(whole, first.p, fitted, tick)
    found = replace(
        first,
        p=solution.p,
        white=solution.covariance,
        gram=solution.gram,
        free=solution.free,
        converged=solution.converged,
    )
    return replace(found, whole=figures(whole.problems(tick), solution.p))


def with_duration(seen: Observations, stream: LogStream) -> Observations:
    """The sample; its last time is that of the log, on which the size of slow effects hangs."""
    if seen.at.t_s is None or stream.t_s is None:
        return seen
    t_s = seen.at.t_s.copy()
    t_s[-1] = stream.t_s[1]
    return replace(seen, at=replace(seen.at, t_s=t_s))


def in_one_piece(stream: LogStream, file: ModelFile, extra: Sequence[Effect] = ()) -> str:
    """Names of effects that need the log in one piece: a sample depends on earlier ones, or residuals are weighed.

    Raises InputError where the log is too long for that.
    """
    effects = [find_effect(name, extra) for name in file.effects]
    why = ", ".join(e.name for e in effects if e.memory or e.loss)
    if why and stream.rows > IN_MEMORY:
        wanted = f"of at most {IN_MEMORY} rows for {why}, which need it in one piece"
        raise InputError(must("the log", wanted, f"{stream.rows} rows", stream.path))
    return why
