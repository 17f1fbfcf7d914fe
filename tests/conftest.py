"""Tests run side by side: threads of the BLAS in each process would wait for each other's processors."""

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")  # before NumPy is imported
