"""NAME: what happens to the field or the reading, in one sentence.

    y_i = x_i (1 + c_i |x|^2)                                                        (1)

x in µT, c in 1/µT^2. Where the equation comes from: a paper, a datasheet, the bench.
"""

import numpy as np

from barberpole.effects.effect import per_axis

EQUATION = "y_i = x_i (1 + c_i |x|^2)"
SUMMARY = "what it does to a reading, in a few words"
SOURCE = "seen on the bench"
STAGE = "field"  # xyz in µT, before the bridge; "reading": in LSB, after everything else
REQUIRES = ()  # columns of the log that it reads: "t_s", "temp_c", "load_a", "supply_v", "i_ma" for the coils
FLIPS = False  # True if SET and RESET differ: at.state is +1 or -1
MEMORY = False  # True if a sample depends on earlier ones: xyz is then the whole log in order


def params(setup):
    """What is fitted. With all at `null` (0 if not said) the effect must be absent; `typical`: the size expected."""
    return per_axis("1/uT^2", typical=0.005 / setup.span_ut**2)


def forward(xyz, p, at):
    """Eq. (1): three components (n,) go in and come out; p are the parameters; `at` holds t_s, temp_c, ... (n,)."""
    x, y, z = xyz
    square = np.sum(np.square(xyz), axis=0)
    return x * (1 + p[0] * square), y * (1 + p[1] * square), z * (1 + p[2] * square)


# Optional: undo(xyz, p, at), the exact inverse in + - * / and np.sqrt. It makes fits faster, and the effect can then
# go into the firmware; without it the field is found by iteration.
