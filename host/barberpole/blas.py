"""One thread for linear algebra, set before numpy is loaded.

The matrices here are a few hundred wide: on two cores a second thread waits more than it helps (diagnosis of 5000 rows
takes 0.25 s with one thread and 0.4 to 1.5 s with two). Whoever wants threads sets the variables.
"""

import os

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
