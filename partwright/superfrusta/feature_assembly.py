"""The assembly that a tree of features becomes: holes apart, open ends further out, groups, plain numbers."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from functools import cached_property, partial

import numpy as np

from partwright.approximation.part_roles import FREEFORM, with_role_names
from partwright.approximation.plain import plain
from partwright.approximation.plain_levels import Levels
from partwright.approximation.plain_numbers import plain_move, with_plain_numbers
from partwright.approximation.sketches.ends import typed_reach, with_open_ends
from partwright.approximation.sketches.holes import holes_apart, is_empty, merged_holes
from partwright.approximation.sketches.round_holes import RoundHole
from partwright.assembly import Assembly, Node, Part
from partwright.assembly.group_copies import in_runs
from partwright.fields import Cylinder, Tube
from partwright.shapes import Shape
from partwright.superfrusta.feature_drilling import empty_round_holes
from partwright.superfrusta.feature_groups import grouped
from partwright.superfrusta.feature_hole_walls import HoleWalls
from partwright.superfrusta.feature_mouths import HoleMouths
from partwright.superfrusta.feature_stacked_cuts import with_cuts_once
from partwright.superfrusta.feature_stepped_holes import with_stepped_holes
from partwright.superfrusta.feature_steps import Feature, FeatureTree, with_open_ends_everywhere
from partwright.superfrusta.flat_tree import Meetings

_PLAIN = 1e-4  # unit lengths: how far numbers are moved to become plain


class FeatureAssembly:
    """Makes assemblies of the trees of one shape; what a feature becomes by itself, and which parts meet, is
    asked once for all of them."""

    def __init__(self, shape: Shape) -> None:
        self.shape, self.distance = shape, shape.unit_distance
        self.reach = typed_reach(shape.frame.scale)
        self._meetings = Meetings()
        self._known: dict[tuple[int, bool], tuple[Feature, list[tuple[Feature, bool]]]] = {}

    @cached_property
    def round_holes(self) -> list[RoundHole]:
        """Of the shape, in the unit frame, in which there is nothing of it."""
        return empty_round_holes(self.shape)

    def named(self, tree: FeatureTree) -> Assembly:
        """The features as a tree of unions and differences, named, in the shape's own units."""
        return with_role_names(dataclasses.replace(self._plain(tree), unit=self.shape.unit))

    def in_unit_frame(self, tree: FeatureTree) -> Assembly:
        """The same without names, as it is measured: rounded numbers may leave skins."""
        return in_unit_frame(self.shape, self._plain(tree))

    def _plain(self, tree: FeatureTree) -> Assembly:
        frame = self.shape.frame
        whole = grouped(self._numbered(tree), self._meetings).scaled(1 / frame.scale).translated(frame.centre)
        within = _PLAIN / frame.scale
        return _with_plain_numbers(whole, within, Levels.of(whole.parts, within))

    def _numbered(self, tree: FeatureTree) -> list[Feature]:
        """Round holes of profiles apart, each size once, with their mouths and counterbores; ends that are
        open further out; names until they say more."""
        result: list[Feature] = []
        drilled: list[Part] = []
        for i, feature in enumerate(tree.features):
            for own, empty in self._alone(feature, i == 0):
                true = [] if own.added else self._true_bores(own)
                if true:
                    drilled += true
                elif empty:
                    drilled += own.parts
                else:
                    result.append(own)
        result = with_cuts_once(result, self.distance)
        none = np.zeros(0, bool)
        result, bores = self._with_bores_apart(result)
        drilled += bores
        mouths = self._mouths(result)
        holes = [one for hole in merged_holes(drilled, self.distance) for one in mouths.of(hole)]
        result += [Feature(False, hole, none, 0) for hole in with_stepped_holes(holes, self.distance)]
        stems = {True: "part", False: "cut"}
        names = [f"{stems[f.added]}_{i:02d}" for i, f in enumerate(result, start=1)]
        for k, i in enumerate((i for i, f in enumerate(result) if f.freeform), start=1):
            names[i] = f"{FREEFORM}_{k}"
        return [
            dataclasses.replace(f, part=dataclasses.replace(f.part, name=name))
            for f, name in zip(result, names, strict=True)
        ]

    def _mouths(self, features: list[Feature]) -> HoleMouths:
        fold = FeatureTree(features).distance
        return HoleMouths(self.round_holes, self.distance, fold, self.reach)

    def _with_bores_apart(self, features: list[Feature]) -> tuple[list[Feature], list[Part]]:
        """Rings whose bore ends in a cone that they fill as discs, and the bores of these."""
        mouths, result, bores = self._mouths(features), list(features), []
        for i, ring in enumerate(features):
            own = _bores(ring)
            if any(mouths.are_missing(bore) and is_empty(bore, self.distance) for bore, _ in own):
                bores += [with_open_ends(bore, False, self.distance, self.reach) for bore, _ in own]
                result[i] = dataclasses.replace(ring, part=dataclasses.replace(ring.part, field=own[0][1]))
        return result, bores

    def _true_bores(self, cut: Feature) -> list[Part]:
        """The shape's own holes in place of a round cut that is as wide as none of their walls; none where it
        is right."""
        walls = HoleWalls(self.round_holes, self.distance)
        found = [walls.of(part) for part in cut.parts]
        bores = [bore for own in found if own is not None for bore in own]
        if any(own is None for own in found):
            return []
        return [with_open_ends(bore, False, self.distance, self.reach) for bore in bores]

    def _alone(self, feature: Feature, is_base: bool) -> list[tuple[Feature, bool]]:
        """Its holes apart, ends that are open further out; and of each whether it is a drilled hole in which
        there is nothing of the shape."""
        key = id(feature), is_base
        if key not in self._known:
            self._known[key] = feature, list(self._steps(feature, is_base))
        return self._known[key][1]

    def _steps(self, feature: Feature, is_base: bool) -> Iterator[tuple[Feature, bool]]:
        if feature.freeform:
            yield feature, False
            return
        part, holes = holes_apart(feature.part) if feature.added else (feature.part, ())
        if not is_base and not all(is_empty(hole, self.distance) for hole in holes):
            part, holes = feature.part, ()  # cut by themselves they would open what is there before
        parts = [(part, feature.added), *((hole, False) for hole in holes)]
        for k, (one, added) in enumerate(parts):
            own = dataclasses.replace(feature, part=one, added=added)
            if not (is_base and k == 0):
                own = with_open_ends_everywhere(own, self.distance, self.reach)
            drilled = not added and isinstance(own.part.field, Cylinder)
            yield own, drilled and is_empty(own.part, self.distance)


def _bores(ring: Feature) -> list[tuple[Part, Cylinder]]:
    """Of a tube that was added, and of its mirror image, what is within, and the disc without it; none of
    others."""
    found = []
    for part in ring.parts if ring.added and not ring.freeform else ():
        if isinstance(part.field, Tube):
            outer, height = part.field.radius, part.field.height
            inner = Cylinder(outer - part.field.thickness, height)
            found.append((dataclasses.replace(part, field=inner), Cylinder(outer, height)))
    return found


def in_unit_frame(shape: Shape, whole: Assembly) -> Assembly:
    x, y, z = (-float(middle) for middle in shape.frame.centre)
    return whole.translated((x, y, z)).scaled(shape.frame.scale)


def _with_plain_numbers(node: Assembly, within: float, levels: Levels) -> Assembly:
    children: list[Node] = []
    for child, copies in in_runs(node):
        if isinstance(child, Part):
            children.append(with_plain_numbers(child, within, levels))
            continue
        first = _with_plain_numbers(child, within, levels)
        children.append(first)
        for k, copy in enumerate(copies, start=2):  # exactly what the first is
            move = plain_move(copy.move, partial(plain, within=within))
            children.append(dataclasses.replace(copy, move=move).of(first, k))
    return dataclasses.replace(node, children=tuple(children))
