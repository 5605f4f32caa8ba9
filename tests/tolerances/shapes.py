"""Shapes and rough assemblies of them: numbers off by a few percent, as a fit leaves them."""

from __future__ import annotations

import trimesh

import partwright as pw
from partwright.fields import Box, Cylinder, SuperFrustum, Tube


def _joined(operation: str, *meshes: trimesh.Trimesh) -> trimesh.Trimesh:
    return getattr(trimesh.boolean, operation)(meshes, engine="manifold")


def boss() -> tuple[trimesh.Trimesh, pw.Assembly]:
    """A plate with a round boss on it."""
    knob = trimesh.creation.cylinder(0.4, 0.6, sections=64).apply_translation((0.3, 0.1, 0.4))
    mesh = _joined("union", trimesh.creation.box((2, 1.2, 0.3)), knob)
    plate = pw.Part(SuperFrustum((1.96, 1.16, 0.3)), (0.01, 0, 0.01), (0.9999, 0.01, 0, 0.01))
    round_ = pw.Part(SuperFrustum((0.78, 0.82, 0.6), roundness=0.97), (0.31, 0.1, 0.4), blend=0.02)
    return mesh, pw.Assembly([plate, round_])


def plate_with_hole() -> tuple[trimesh.Trimesh, pw.Assembly]:
    """A plate less a cylinder, as solids: a difference."""
    drill = trimesh.creation.cylinder(0.3, 2, sections=64).apply_translation((0.4, 0, 0))
    mesh = _joined("difference", trimesh.creation.box((2, 1.2, 0.3)), drill)
    plate = pw.Part(Box((2.03, 1.18, 0.31)), (0.01, 0, 0))
    hole = pw.Part(Cylinder(0.29, 0.5), (0.41, 0.01, 0))
    return mesh, pw.Assembly([plate, hole], "difference")


def legs() -> tuple[trimesh.Trimesh, pw.Assembly]:
    """A top on two legs that are one part with an instance."""
    sides = [trimesh.creation.box((0.2, 1, 1)).apply_translation((x, 0, -0.5)) for x in (-0.8, 0.8)]
    mesh = _joined("union", trimesh.creation.box((2, 1, 0.2)), *sides)
    moves = (pw.assembly.Similarity(translation=(1.6, 0, 0)),)
    leg = pw.Part(Box((0.22, 0.97, 1)), (-0.81, 0, -0.5), instances=moves)
    return mesh, pw.Assembly([pw.Part(Box((2.02, 0.98, 0.21))), leg])


def tube() -> tuple[trimesh.Trimesh, pw.Assembly]:
    mesh = trimesh.creation.annulus(0.7, 1.0, 2.0, sections=96)
    return mesh, pw.Assembly([pw.Part(Tube(0.98, 0.33, 1.97), (0.01, -0.01, 0.02))])


ALL = {"boss": boss, "plate_with_hole": plate_with_hole, "legs": legs, "tube": tube}
