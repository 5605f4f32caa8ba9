"""Method "superfrusta": assemblies of SuperFrusta by Residual Primitive Fitting."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from partwright.methods import Ability, FitRequest, Fitted, Method
from partwright.superfrusta.fit import fit
from partwright.superfrusta.settings import Settings


class SuperFrusta(Method[Settings]):
    name = "superfrusta"
    can = frozenset(Ability)

    def settings(self, quality: str = "normal", **changes: Any) -> Settings:
        return Settings.for_quality(quality, **changes)

    def denser(self, settings: Settings, share: float) -> Settings:
        return replace(settings, alpha=settings.alpha * share)

    def fit(self, request: FitRequest[Settings]) -> Fitted:
        return fit(request)


METHOD = SuperFrusta()
