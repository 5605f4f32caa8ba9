"""What all tests share."""

from __future__ import annotations

from hypothesis import settings

# A busy machine is no defect: how long an example takes is measured by benchmarks, not by tests.
settings.register_profile("patient")
settings.load_profile("patient")
