"""Orders that processes carry out: in their order, with what was bound once, and deaf to Ctrl-C."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import closing
from functools import partial
from pathlib import Path

import psutil
import pytest

from partwright.errors import SettingError
from partwright.processes import carried_out, one_a_processor


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


def test_one_a_processor_is_meant_where_none_are_given() -> None:
    assert one_a_processor(None) == os.cpu_count()
    assert one_a_processor(3) == 3
    with pytest.raises(SettingError, match="workers: expected a whole number of at least 1, got 0"):
        one_a_processor(0)


def test_they_are_deaf_to_ctrl_c_and_end_when_they_are_no_longer_asked() -> None:
    with closing(carried_out(_interrupted, range(40), 2)) as made:
        assert [next(made) for _ in range(3)] == [0, 1, 2]
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, set())  # who began them is not


def test_what_an_order_raises_there_is_raised_here() -> None:
    made = carried_out(_refused, range(4), 2)
    assert next(made) == 0
    with pytest.raises(SettingError, match=r"^1 is refused$"):
        next(made)


LEFT = """
import os, time
from partwright.processes import carried_out

def told(order):
    if order < 2:
        return os.getpid()
    time.sleep(60)

if __name__ == "__main__":
    made = carried_out(told, range(6), 2)
    print(next(made), next(made), flush=True)
    os._exit(0)
"""


def test_they_end_with_who_began_them(tmp_path: Path) -> None:
    """Who hears Ctrl-C ends at once, and tells nobody; orders may take minutes."""
    (tmp_path / "left.py").write_text(LEFT)
    begun = subprocess.run(
        [sys.executable, tmp_path / "left.py"], capture_output=True, text=True, check=True, timeout=50
    )
    assert begun.stderr == ""
    # It came back at all: what they write to was closed, so none of them has it open any more.
    gone = [psutil.Process(int(one)) for one in begun.stdout.split() if psutil.pid_exists(int(one))]
    assert not psutil.wait_procs(gone, timeout=10)[1]


def test_a_process_that_is_ended_is_told() -> None:
    with pytest.raises(SettingError, match="one of 2 processes was ended, perhaps for want of memory"):
        list(carried_out(_killed, range(4), 2))
