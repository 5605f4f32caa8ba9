"""Small meshes that a few SuperFrusta explain exactly, or nearly."""

from __future__ import annotations

import numpy as np
import trimesh
from manifold3d import CrossSection, Manifold


def box(size, centre=(0.0, 0.0, 0.0)) -> trimesh.Trimesh:
    return trimesh.creation.box(size).apply_translation(centre)


def union(*meshes: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.boolean.union(meshes, engine="manifold")


def bracket() -> trimesh.Trimesh:
    """An L of two boxes."""
    return union(box((2, 1, 0.3)), box((0.3, 1, 1.5), (-0.85, 0, 0.6)))


def table() -> trimesh.Trimesh:
    """A top and four legs."""
    legs = [box((0.15, 0.15, 1.05), (x, y, 0.5)) for x in (-0.85, 0.85) for y in (-0.5, 0.5)]
    return union(box((2, 1.2, 0.15), (0, 0, 1)), *legs)


def corner_tie() -> trimesh.Trimesh:
    """Three thin plates: one lying, one standing, one leaning down to a corner of the bounding box."""
    turned = trimesh.transformations.rotation_matrix(np.radians(-45), (0, 1, 0))
    leaning = box((1.2, 1.1, 0.08)).apply_transform(turned).apply_translation((0.45, 0, -0.4))
    return union(box((1.05, 1.1, 0.08), (-0.38, 0, 0)), leaning, box((0.08, 1.1, 0.8), (0.1, 0, 0.4)))


def pipe() -> trimesh.Trimesh:
    """A tube of outer radius 1, wall 0.3 and height 2."""
    return trimesh.creation.annulus(0.7, 1.0, 2.0)


def half_torus() -> trimesh.Trimesh:
    """A round rod bent through 180 degrees."""
    section = CrossSection.circle(0.2, 32).translate((1.0, 0.0))
    made = Manifold.revolve(section, 64, 180).to_mesh()
    return trimesh.Trimesh(np.asarray(made.vert_properties)[:, :3], np.asarray(made.tri_verts))


def drilled_block() -> trimesh.Trimesh:
    """A block with three holes through it and a pocket: five solids, four of them taken away."""
    holes = [
        trimesh.creation.cylinder(radius, 2).apply_translation((x, y, 0))
        for radius, x, y in ((0.25, -0.6, 0.2), (0.2, 0.1, -0.3), (0.3, 0.6, 0.25))
    ]
    cut = [*holes, box((0.7, 0.3, 0.4), (-0.45, -0.4, 0.3))]
    return trimesh.boolean.difference([box((2, 1.4, 0.6)), *cut], engine="manifold")
