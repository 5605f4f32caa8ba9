"""The kernel's threads: they change no bit, are shared by all who ask at once, and made anew after a fork."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from partwright.fields import kernel
from partwright.superfrusta.limits import LIMITS
from partwright.superfrusta.refining import COARSE_TO_FINE
from tests.superfrusta.rows import row

Call = Callable[[int], Any]


def several_parts() -> np.ndarray:
    places = np.random.default_rng(3).uniform(-0.6, 0.6, (8, 3))
    return np.stack([row(place, size=(0.5, 0.4, 0.7), roundness=0.4, taper=0.8) for place in places])


def calls() -> dict[str, Call]:
    """Each with as many points as it takes until several threads are at it."""
    generator, rows = np.random.default_rng(0), several_parts()
    points = generator.uniform(-1, 1, (40_000, 3)).astype(np.float32)
    distance = kernel.evaluate(rows, points, 1)
    inside, weight = distance < 0, generator.uniform(1, 2, len(points)).astype(np.float32)
    target = kernel.Target(points, distance, weight / weight.sum())
    moved = rows.copy()
    moved[:, :3] += 0.05
    third = len(points) // 3
    ranges = np.repeat([[0, third], [third, 3 * third]], 4, axis=0)
    occupied = generator.uniform(size=(60, len(points))) < 0.5
    terms = kernel.Penalties(0.1, 0.1)
    return {
        "evaluate": lambda t: kernel.evaluate(rows, points, t),
        "evaluate_parts": lambda t: kernel.evaluate_parts(rows, points, t),
        "covered": lambda t: kernel.covered(rows, points, t),
        "gradients": lambda t: kernel.gradients(rows, points, weight, t),
        "occupancy_sums": lambda t: kernel.occupancy_sums(occupied, inside, weight, third, t),
        "removal_counts": lambda t: kernel.removal_counts(rows, points, inside, weight, t),
        "loss": lambda t: kernel.loss(moved, target, 40.0, terms, t),
        "normal_equations": lambda t: kernel.normal_equations(moved, target, 40.0, terms, t),
        "levenberg_marquardt": lambda t: kernel.levenberg_marquardt(
            moved, target, COARSE_TO_FINE, LIMITS, penalties=terms, threads=t
        ),
        "fit_starts": lambda t: kernel.fit_starts(moved, ranges, target, COARSE_TO_FINE, LIMITS, threads=t),
    }


CALLS = calls()


def as_bytes(found: Any) -> list[bytes]:
    return [np.asarray(one).tobytes() for one in (found if isinstance(found, tuple) else (found,))]


@pytest.mark.parametrize("name", CALLS)
def test_threads_do_not_change_a_bit(name: str) -> None:
    alone = as_bytes(CALLS[name](1))
    for threads in (2, 3, 7, 16):
        assert as_bytes(CALLS[name](threads)) == alone


def test_several_that_ask_at_once_have_what_each_would_have_alone() -> None:
    names = [*CALLS] * 2
    alone = {name: as_bytes(call(1)) for name, call in CALLS.items()}
    with ThreadPoolExecutor(5) as pool:
        found = list(pool.map(lambda name: as_bytes(CALLS[name](3)), names))
    assert found == [alone[name] for name in names]


@pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="threads are counted as Linux tells them")
def test_threads_stay_and_are_not_more_than_are_asked_for() -> None:
    program = (
        "import os, numpy as np; from partwright.fields import kernel\n"
        "from tests.fields.test_kernel_threads import CALLS\n"
        "before = len(os.listdir('/proc/self/task'))\n"
        "counts = [CALLS[name](4) is None or len(os.listdir('/proc/self/task')) for name in [*CALLS] * 3]\n"
        "most = max(4, os.cpu_count())\n"
        "assert before < counts[-1] == max(counts) <= before + most - 1, (before, counts)\n"
        "assert CALLS['evaluate'](1) is not None\n"
    )
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    subprocess.run([sys.executable, "-c", program], check=True, env=environment, timeout=120)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no processes are forked here")
def test_a_forked_process_has_threads_of_its_own() -> None:
    """Also where others are at work while it is forked."""
    wanted, ended = as_bytes(CALLS["evaluate"](1)), threading.Event()

    def work() -> None:
        while not ended.is_set():
            CALLS["evaluate"](3)

    busy = threading.Thread(target=work)
    busy.start()
    try:
        for _ in range(5):
            child = os.fork()
            if child == 0:
                os._exit(as_bytes(CALLS["evaluate"](3)) != wanted)
            assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    finally:
        ended.set()
        busy.join()
