"""Method "capri": CSG trees of quadrics (CAPRI-Net), from detected surfaces, the network, or both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from partwright.approximation.named_convexes import with_named_convexes
from partwright.approximation.part_roles import with_role_names
from partwright.assembly import Assembly
from partwright.capri.csg_tree import CsgTree
from partwright.capri.repeated_quadrics import with_repeats
from partwright.capri.settings import Settings
from partwright.capri.tree_search import TreeSearch
from partwright.errors import CancelledError, EmptyShapeError, SettingError
from partwright.methods import Ability, Checkpoint, FitRequest, Fitted, Method, Outcome
from partwright.metrics.complexity import convexes, distinct_primitives, primitives
from partwright.shapes import Shape

ORIGINS = {"seeds": "detected surfaces", "weights": "pre-trained network"}


class Capri(Method[Settings]):
    """CSG trees. Quadrics detected on the surface of a start join those on the shape's."""

    name = "capri"
    can = frozenset(
        {
            Ability.BUDGET,
            Ability.TARGET,
            Ability.START,
            Ability.SYMMETRY,
            Ability.SUBTRACT,
            Ability.PER_NODE,
            Ability.CUDA,
        }
    )

    def settings(self, quality: str = "normal", **changes: Any) -> Settings:
        return Settings.for_quality(quality, **changes)

    def fit(self, request: FitRequest[Settings]) -> Fitted:
        """A tree in the shape's own units.

        Raises:
            EmptyShapeError: no tree explains anything (the shape is thinner than the samples can see).
            CancelledError: cancelled before there was a tree.
            NoSurfaceError: the start has no surface.
            SettingError: an accelerator is asked for and the search is to run, which is the CPU's.
            MissingDependencyError: the paper's schedule or the pre-trained network is asked for without
                PyTorch.
        """
        return found(request).fitted()


METHOD = Capri()


@dataclass(frozen=True)
class Found:
    """Searches that came to a tree, the cheapest first."""

    shape: Shape
    settings: Settings
    searches: Sequence[TreeSearch]
    tree: CsgTree
    """The cheapest search's, in the unit frame."""
    seconds: dict[str, float]
    interrupted: bool

    @cached_property
    def assembly(self) -> Assembly:
        """In the shape's own units."""
        return assembly_of(self.shape, self.settings, self.tree)

    @cached_property
    def quadrics(self) -> Assembly:
        """The same as quadrics alone, which is what the paper counts."""
        return assembly_of(self.shape, replace(self.settings, named=False), self.tree)

    @property
    def outcome(self) -> Outcome:
        return "interrupted" if self.interrupted else self.searches[0].outcome

    @cached_property
    def details(self) -> dict[str, Any]:
        """For the report: which start was best, and how much the tree holds."""
        best = self.searches[0]
        return {
            "schedule": self.settings.schedule,
            "start": ORIGINS[best.origin],
            "costs": {ORIGINS[one.origin]: round(one.cost(), 5) for one in self.searches},
            "candidates": len(best.pool.rows),
            "primitives": primitives(self.quadrics, groups_once=True),
            "convexes": convexes(self.quadrics, groups_once=True),
            "distinct_primitives": distinct_primitives(self.quadrics, groups_once=True),
            "solids": sum(part.field.quadric() is None for part in self.assembly.parts),
        }

    def fitted(self) -> Fitted:
        best = self.searches[0]
        return Fitted(self.assembly, self.outcome, self.seconds, best.history, details={"tree": self.details})


def found(request: FitRequest[Settings]) -> Found:
    """Searches a tree from each origin that the settings name; errors as of `Capri.fit`."""
    shape, settings, run = request.shape, request.settings.of_schedule(), request.run
    if run.device == "cuda" and settings.schedule == "search":
        raise SettingError('the search of trees runs on the CPU; use device "auto", or schedule "paper"')
    origins = ("seeds", "weights") if settings.start == "auto" else (settings.start,)
    checkpoint = Checkpoint(run.cancel)
    searches = [
        TreeSearch(
            settings,
            run,
            checkpoint,
            origin,
            (i, len(origins)),
            lambda tree: assembly_of(shape, replace(settings, named=False), tree),
        )
        for i, origin in enumerate(origins)
    ]
    interrupted, tree = False, None
    done: list[TreeSearch] = []
    try:
        for search in searches:
            search.prepare(shape, request.start)
            search.make(shape)
        done = _cheapest_first(searches)
        tree = done[0].final_tree() if done else None
    except CancelledError:
        interrupted = True
        done = done or _cheapest_first(searches)
        if not done:
            raise
    if not done and settings.schedule == "paper":
        raise EmptyShapeError(
            f"{shape.name}: after 3 x {settings.iterations} iterations no convex holds anything; give more "
            'iterations, or start "seeds"'
        )
    if not done:
        raise EmptyShapeError(
            f"{shape.name}: no convex could be placed; the shape has no volume that {settings.near} samples "
            "can see. Check its thickness, or use --quality high"
        )
    seconds: dict[str, float] = {}
    for one in searches:
        seconds |= {stage: seconds.get(stage, 0.0) + spent for stage, spent in one.seconds.items()}
    return Found(shape, settings, done, tree or done[0].bounded_tree(), seconds, interrupted)


def _cheapest_first(searches: Sequence[TreeSearch]) -> list[TreeSearch]:
    """Those that came to a tree."""
    return sorted((search for search in searches if search.placed), key=TreeSearch.cost)


def assembly_of(shape: Shape, settings: Settings, tree: CsgTree) -> Assembly:
    """A tree of the unit frame in the shape's own units; alike holes are one leaf with copies, and convexes
    the solids that they are."""
    whole = with_repeats(tree.assembly()) if settings.symmetry else tree.assembly()
    if settings.named:
        whole = with_role_names(with_named_convexes(whole))
    return replace(whole, unit=shape.unit).scaled(1 / shape.frame.scale).translated(shape.frame.centre)
