"""A fit with everything beside it that its residual may depend on: absent effects and covariates, in one table."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from barberpole.diagnose.candidates import Absent, candidates
from barberpole.diagnose.columns import Candidate
from barberpole.diagnose.covariates import Covariate, covariates, ripples
from barberpole.diagnose.ground import Ground, ground_of
from barberpole.diagnose.table import Design, Products, Projection, Table, multiply, parts_of, project, tabulate
from barberpole.diagnose.whitening import Whitening
from barberpole.effects import Effect
from barberpole.fit.fit import MAD, OUTLIER, Fit
from barberpole.fit.noise import Noise, estimate

ENOUGH_ROWS = 8  # residuals a column: with fewer, the colour of the noise is lost in what the columns take
FEW = 4  # residuals a column: with fewer, what is left of them is no noise


@dataclass(frozen=True)
class Evidence:
    """Places of the columns in the table: `baseline`, one for each candidate, (channel, covariate, columns)."""

    ground: Ground
    candidates: list[Candidate]
    places: list[np.ndarray]
    covariates: list[tuple[int, Covariate, np.ndarray]]
    baseline: np.ndarray
    design: Design
    products: Products
    white: Whitening
    table: Table
    projection: Projection

    @property
    def fit(self) -> Fit:
        return self.ground.fit

    @property
    def all_covariates(self) -> np.ndarray:
        """Columns of all covariates."""
        return np.concatenate([columns for _, _, columns in self.covariates])

    def gain(self, columns: np.ndarray, forms: int = 1) -> float:
        """Gain in BIC by these columns."""
        score, rank = self.projection.score(columns)
        return bic_gain(self.projection.rss, score, rank, self.table.count, forms)

    def p_value(self, columns: np.ndarray) -> float:
        """Chance of a fall this large without a cause."""
        score, rank = self.projection.score(columns)
        left = max(self.projection.rss - score, 1e-300) / max(self.projection.freedom - rank, 1.0)
        return float(max(chdtrc(rank, score / left), 1e-300)) if rank else 1.0

    def under(self, white: Whitening) -> "Evidence":
        """The same evidence under another noise."""
        table = tabulate(self.design, white, self.products)
        return replace(self, white=white, table=table, projection=project(table, self.baseline))

    def background(self) -> Noise:
        """The noise left by all that any candidate or covariate can take; white in a log too short to tell."""
        if self.table.count < FEW * self.design.count:
            level = self.projection.rss * float(np.mean(self.white.noise.white)) / self.projection.freedom
            return Noise(np.full(self.ground.residual.shape[0], level))
        g, last = self.products.table().total, self.design.count - 1
        size = np.sqrt(np.maximum(np.diag(g)[:last], 1e-300))
        inverse = np.linalg.pinv(g[:last, :last] / np.outer(size, size), rcond=1e-9, hermitian=True)
        left = self.design.combine(np.append(-inverse @ (g[:last, -1] / size) / size, 1.0))
        limit = OUTLIER * MAD * np.median(np.abs(left), axis=1, keepdims=True)
        left = np.clip(left, -limit, limit)  # a few giants would colour any spectrum
        return estimate(left, "residual", self.design.kept(self.products), self.ground.normal)


def unsure_of_noise(evidence: Evidence) -> bool:
    """A scalar residual of coloured noise that nobody measured: slow structure and noise look alike in it."""
    noise = evidence.white.noise
    if evidence.ground.normal is None or noise.source != "residual":
        return False
    too_few = evidence.table.count < ENOUGH_ROWS * evidence.design.count
    return noise.coloured or (too_few and estimate(evidence.ground.residual, "residual").coloured)


def bic_gain(rss: float, score: float, rank: int, count: float, forms: int = 1) -> float:
    """-N log(1 - S/RSS) - p log N - 2 log(forms)."""
    share = min(max(score / max(rss, 1e-300), 0.0), 1.0 - 1e-12)
    return float(-count * np.log1p(-share) - rank * np.log(count) - 2.0 * np.log(forms))


def examine(fit: Fit, absent: Absent | None, white: Whitening | None = None, extra: Sequence[Effect] = ()) -> Evidence:
    """Everything beside a fit. Without a noise the residual's own mean square stands for it."""
    ground = ground_of(fit, extra)
    level = float(np.mean(ground.residual**2)) or 1.0
    white = white or Whitening(Noise(np.full(ground.residual.shape[0], level)))
    design = Design(ground.residual.shape[0])
    columns = ground.baseline()
    baseline = design.add(parts_of(columns), columns.shape[1])
    found = candidates(ground, absent) if absent else []
    places = [design.add(one.parts, len(one.names)) for one in found]
    known = _covariates(ground, design)
    design.add(parts_of(ground.residual[:, None]), 1)
    products = multiply(design)
    table = tabulate(design, white, products)
    projection = project(table, baseline)
    return Evidence(ground, found, places, known, baseline, design, products, white, table, projection)


def _covariates(ground: Ground, design: Design) -> list[tuple[int, Covariate, np.ndarray]]:
    seen, channels = ground.fit.problem.seen, ground.residual.shape[0]
    found = covariates(seen, ground.field)
    if channels == 3:
        # the reading as predicted: its own noise would be a cause of the residual
        found += ripples(seen.y - ground.residual, ground.residual)
    return [
        (channel, c, design.add_to(channel, c.basis))
        for c in found
        for channel in range(channels)
        if c.channel in (None, channel)
    ]


def whitened_rss(fit: Fit, white: Whitening, extra: Sequence[Effect] = ()) -> tuple[Table, np.ndarray]:
    """Table of a fit's own columns and its residual, and which columns are the fit's."""
    ground = ground_of(fit, extra)
    design = Design(ground.residual.shape[0])
    columns = ground.baseline()
    baseline = design.add(parts_of(columns), columns.shape[1])
    design.add(parts_of(ground.residual[:, None]), 1)
    return tabulate(design, white), baseline
