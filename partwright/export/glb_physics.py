"""What physics a GLB may have, without the rooms that make colliders: hardly any has them."""

from __future__ import annotations

from partwright.errors import SettingError

KHR = "khr"
ENGINES = ("unreal", "godot")


def check_physics(physics: str | None, density: float | None, free_joint: bool) -> None:
    """Raises SettingError for a kind of physics that there is not, or for what it has no place for."""
    if physics not in (None, KHR, *ENGINES):
        raise SettingError(f"physics: expected one of {', '.join((KHR, *ENGINES))}, got {physics!r}")
    if physics != KHR and (density is not None or free_joint):
        raise SettingError("density and free_joint are of rigid bodies: they need physics khr")
