"""Jobs side by side: results and failures of one after another, within the threads that there are."""

from __future__ import annotations

import os
import threading
import time
from functools import partial

import numpy as np
import pytest
import trimesh

import partwright as pw
from partwright.at_once import at_once, both, in_turn, limited, share_of, thread_count


def squared(number: int) -> int:
    time.sleep(0.001 * (7 - number % 7))
    return number * number


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_results_come_in_the_order_of_the_jobs(threads: int) -> None:
    jobs = [partial(squared, number) for number in range(12)]
    assert at_once(jobs, threads) == list(in_turn(jobs, threads)) == [number**2 for number in range(12)]
    assert both(jobs[2], lambda: "two", threads) == (4, "two")
    assert at_once([], threads) == []


def test_no_more_jobs_run_at_a_time_than_there_are_threads() -> None:
    lock, running, most = threading.Lock(), 0, 0

    def job() -> None:
        nonlocal running, most
        with lock:
            running += 1
            most = max(most, running)
        time.sleep(0.002)
        with lock:
            running -= 1

    at_once([job] * 20, 3)
    assert 1 < most <= 3


def test_the_first_job_is_done_by_who_asks() -> None:
    for _ in range(20):
        first, *_ = at_once([threading.get_ident] * 4, 4)
        assert first == threading.get_ident()


@pytest.mark.parametrize("threads", [1, 4])
def test_a_failure_is_that_of_the_first_job_that_fails(threads: int) -> None:
    def fail(number: int) -> None:
        time.sleep(0.002)
        raise ValueError(str(number))

    with pytest.raises(ValueError, match="0"):
        at_once([partial(fail, number) for number in range(4)], threads)
    assert at_once([lambda: 1], threads) == [1]


def test_on_one_thread_nothing_is_done_before_it_is_asked_for() -> None:
    done: list[int] = []
    results = in_turn([partial(done.append, number) for number in range(5)], 1)
    next(results)
    assert done == [0]


def test_jobs_of_jobs_share_the_threads_and_end() -> None:
    def inner(number: int) -> int:
        assert thread_count(share_of(0)) == thread_count(share_of(4)) <= 2
        return number

    def outer(number: int) -> int:
        assert share_of(8) <= 2
        return sum(at_once([partial(inner, number + i) for i in range(10)], 0))

    found = at_once([partial(outer, number) for number in range(30)], 2)
    assert found == [10 * number + 45 for number in range(30)]


def test_who_is_left_alone_has_all_threads() -> None:
    shares: list[int] = []

    def late() -> None:
        time.sleep(0.05)
        shares.append(share_of(4))

    at_once([late, lambda: shares.append(share_of(4))], 4)
    assert shares[0] <= 4
    assert shares[-1] == 4


def test_a_limit_holds_for_all_that_is_asked_within() -> None:
    with limited(1):
        assert share_of(0) == share_of(8) == 1
        idents = at_once([threading.get_ident] * 8, 0)
        assert set(idents) == {threading.get_ident()}
    assert share_of(8) == 8


def test_settings_of_a_context_hold_in_its_jobs() -> None:
    with np.errstate(divide="raise"):

        def divided() -> float:
            time.sleep(0.005)
            return float(np.float64(1) / np.float64(0))

        with pytest.raises(FloatingPointError):
            at_once([lambda: time.sleep(0.01), divided], 2)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no processes are forked here")
def test_a_forked_process_has_threads_of_its_own() -> None:
    jobs = [partial(squared, number) for number in range(6)]
    at_once(jobs, 3)
    child = os.fork()
    if child == 0:
        os._exit(at_once(jobs, 3) != [number**2 for number in range(6)])
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def test_a_fit_on_one_thread_takes_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its meshes and scores, which are asked for without a number of threads, do not either."""
    monkeypatch.setattr("partwright.at_once._threads", lambda: pytest.fail("asked for threads"))
    fitted = pw.fit(pw.load_shape(trimesh.creation.box((1.0, 0.6, 0.4))), quality="draft", threads=1)
    assert fitted.scores.iou > 0.98
