"""Orders that processes carry out: in their order, with what was bound once, and deaf to Ctrl-C."""

from __future__ import annotations

import os
import signal
from contextlib import closing
from functools import partial

import pytest

from partwright.errors import SettingError
from partwright.processes import carried_out


def _scaled(factor: int, order: int) -> tuple[int, int]:
    return factor * order, os.getpid()


def _interrupted(order: int) -> int:
    os.kill(os.getpid(), signal.SIGINT)
    return order


def _refused(order: int) -> int:
    if order == 1:
        raise SettingError(f"{order} is refused")
    return order


def _killed(order: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return order


def test_orders_come_back_as_they_stand() -> None:
    here = [*carried_out(partial(_scaled, 3), range(7), 1)]
    assert here == [(3 * i, os.getpid()) for i in range(7)]
    there = [*carried_out(partial(_scaled, 3), range(7), 2, at_once=2)]
    assert [value for value, _ in there] == [3 * i for i in range(7)]
    assert os.getpid() not in {process for _, process in there}
    # No process is begun for what one takes at once.
    assert {process for _, process in carried_out(partial(_scaled, 3), range(4), 2, at_once=4)} == {
        os.getpid()
    }


def test_they_are_deaf_to_ctrl_c_and_end_when_they_are_no_longer_asked() -> None:
    with closing(carried_out(_interrupted, range(40), 2)) as made:
        assert [next(made) for _ in range(3)] == [0, 1, 2]
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, set())  # who began them is not


def test_what_an_order_raises_there_is_raised_here() -> None:
    made = carried_out(_refused, range(4), 2)
    assert next(made) == 0
    with pytest.raises(SettingError, match=r"^1 is refused$"):
        next(made)


def test_a_process_that_is_ended_is_told() -> None:
    with pytest.raises(SettingError, match="one of 2 processes was ended, perhaps for want of memory"):
        list(carried_out(_killed, range(4), 2))
