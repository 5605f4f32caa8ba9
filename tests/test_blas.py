"""BLAS on one thread while fits run, and on as many as before when the last of them has ended."""

from __future__ import annotations

import trimesh
from threadpoolctl import threadpool_info, threadpool_limits

import partwright as pw
from partwright.blas import one_blas_thread
from partwright.superfrusta import Settings


def blas_threads() -> set[int]:
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


def test_the_last_of_several_lifts_the_limit() -> None:
    with threadpool_limits(2, user_api="blas"):
        first, second = one_blas_thread(), one_blas_thread()
        with first:
            second.__enter__()
            assert blas_threads() == {1}
        assert blas_threads() == {1}
        second.__exit__(None, None, None)
        assert blas_threads() == {2}


def test_a_fit_runs_on_one_and_leaves_what_was_there() -> None:
    seen: list[set[int]] = []
    quick = Settings(rounds=1, mends=0, near=2000, uniform=2000, resolution=32)
    shape = pw.load_shape(trimesh.creation.box((2, 1, 1)))
    with threadpool_limits(2, user_api="blas"):
        pw.fit(shape, quick, progress=lambda _: seen.append(blas_threads()))
        assert blas_threads() == {2}
    assert seen
    assert all(threads == {1} for threads in seen)
