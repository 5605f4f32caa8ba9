"""Where PyTorch computes: what "auto", "cpu" and "cuda" mean on this machine."""

from __future__ import annotations

from typing import TYPE_CHECKING

from partwright.errors import SettingError
from partwright.methods import DEVICES

if TYPE_CHECKING:
    import torch


def device_of(name: str) -> torch.device:
    """The device of a name; "auto" is an NVIDIA accelerator where PyTorch finds one.

    Raises:
        SettingError: cuda is asked for and absent, or it is another name.
    """
    import torch

    if name not in DEVICES:
        raise SettingError(f"device is {name!r}; expected one of {', '.join(DEVICES)}")
    found = torch.cuda.is_available()
    if name == "cuda" and not found:
        raise SettingError("device cuda was asked for, but PyTorch finds none; use --device cpu")
    return torch.device("cuda" if found and name != "cpu" else "cpu")
