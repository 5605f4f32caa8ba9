"""Jobs side by side: in their order, on as many threads as are given, the first error raised."""

from __future__ import annotations

import threading
from functools import partial

import pytest

from partwright.errors import CancelledError
from partwright.threads import ahead, at_once, granted


@pytest.mark.parametrize("threads", [0, 1, 2, 9])
def test_what_jobs_return_comes_as_they_stand(threads: int) -> None:
    assert at_once([partial(pow, 2, n) for n in range(20)], threads) == [2**n for n in range(20)]
    assert at_once([], threads) == []


def test_jobs_run_beside_one_another_and_on_one_thread_here() -> None:
    meeting = threading.Barrier(2)
    assert sorted(at_once([partial(meeting.wait, 30)] * 2, 2)) == [0, 1]
    assert set(at_once([threading.get_ident] * 3, 1)) == {threading.get_ident()}


def test_after_an_error_no_more_jobs_are_begun() -> None:
    begun: list[int] = []

    def job(number: int) -> None:
        begun.append(number)
        if number == 1:
            raise CancelledError("enough")
        if number:
            both.wait(30)

    both = threading.Event()
    threading.Timer(0.5, both.set).start()
    with pytest.raises(CancelledError, match="enough"):
        at_once([partial(job, n) for n in range(50)], 2)
    assert len(begun) < 5


@pytest.mark.parametrize(("threads", "made"), [(1, 3), (2, 4), (4, 4)])
def test_jobs_ahead_are_as_many_as_there_are_threads(threads: int, made: int) -> None:
    done: list[int] = []

    def job(number: int) -> int:
        done.append(number)
        return number

    found = ahead([partial(job, n) for n in range(10)], threads)
    assert [next(found) for _ in range(3)] == [0, 1, 2]
    assert sorted(done) == list(range(made))


def test_a_job_has_its_share_of_the_threads() -> None:
    """And what it does at once, has a share of that; on two, all are alive until the last has ended."""

    def nested() -> list[int]:
        return at_once([partial(granted, 9)] * 4, 8)

    assert at_once([partial(granted, 12)] * 3, 12) == [4, 4, 4]
    assert at_once([nested] * 4, 12) == [[2] * 4] * 4
    assert at_once([partial(granted, 2)] * 5, 2) == [2] * 5
    assert granted(7) == 7
    assert granted(0) >= 1
