"""Ctrl-C while a result is scored and written waits; before and after it works as ever."""

from __future__ import annotations

import os
import signal
import threading

import pytest

from partwright.atomic_io import finishing


def test_an_interruption_does_not_undo_what_is_being_finished() -> None:
    done = []
    with finishing():
        os.kill(os.getpid(), signal.SIGINT)
        done.append("written")
    assert done == ["written"]


def test_afterwards_ctrl_c_works_again() -> None:
    with finishing():
        pass
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


def test_other_threads_may_finish_too() -> None:
    reached: list[bool] = []

    def work() -> None:
        with finishing():
            reached.append(True)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert reached == [True]
