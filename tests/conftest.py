"""Tests run side by side: threads of the BLAS in each process would wait for each other's processors."""

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")  # before NumPy is imported

from hypothesis import HealthCheck, settings  # noqa: E402

settings.register_profile("busy", deadline=None, suppress_health_check=[HealthCheck.too_slow])  # machines may be
settings.load_profile("busy")
