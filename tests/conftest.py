"""What all tests share."""

from __future__ import annotations

import signal

from hypothesis import settings

# A busy machine is no defect: how long an example takes is measured by benchmarks, not by tests.
# The same examples each time, so that a change is judged by what it changes; others are drawn by
# `--hypothesis-profile=search`.
settings.register_profile("patient", deadline=None, derandomize=True)
settings.register_profile("search", deadline=None)
settings.load_profile("patient")

# A shell starts background jobs with Ctrl-C ignored, and Python then leaves it so.
signal.signal(signal.SIGINT, signal.default_int_handler)
