from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest
import torch

from partwright.partsdf.cores import one_core_each


@pytest.fixture
def three_cores() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(3)
    yield
    torch.set_num_threads(before)


def test_operations_take_one_core_and_then_all_again(three_cores: None) -> None:
    with one_core_each() as cores, one_core_each() as nested:
        assert cores == nested == 3
        assert torch.get_num_threads() == 1
    assert torch.get_num_threads() == 3
    with pytest.raises(ValueError, match="within"), one_core_each():
        raise ValueError("within")
    assert torch.get_num_threads() == 3


def test_a_thread_that_comes_in_between_knows_all_cores(three_cores: None) -> None:
    told: list[int] = []
    ended = threading.Event()

    def other() -> None:
        with one_core_each() as cores:
            told.append(cores)
            ended.wait(60)
        told.append(torch.get_num_threads())

    with one_core_each():
        thread = threading.Thread(target=other)
        thread.start()
        while not told:
            pass
        assert torch.get_num_threads() == 1
    ended.set()
    thread.join()
    assert told == [3, 3]
    assert torch.get_num_threads() == 3
