"""Parts that touch, and by how much each number brings them apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from partwright.assembly import Assembly
from partwright.errors import NoSurfaceError
from partwright.fields.joint import JointField
from partwright.goals.composite import Composite
from partwright.goals.parameters import Parameters
from partwright.meshing import mesh_part

_CELLS = 24  # along a part, of the surface on which another is looked for
_TOUCH = 2e-3  # of the longest side: parts this near touch
_KEPT = 0.25  # of the depth at the start by which parts reach into one another: what is left at least


@dataclass(frozen=True)
class Contact:
    """Leaves a, b. depth: signed distance of b where a's surface reaches deepest into it, `point` (3,)."""

    a: int
    b: int
    depth: float
    point: np.ndarray


def contacts(assembly: Assembly, pairs: list[tuple[int, int]] | None = None) -> list[Contact]:
    """Pairs of parts with how deep one reaches into the other; without `pairs` those that touch."""
    needed = set(range(len(assembly))) if pairs is None else {i for pair in pairs for i in pair}
    nothing = np.zeros((0, 3))
    surfaces = [part_surface(assembly, i) if i in needed else nothing for i in range(len(assembly))]
    if not any(map(len, surfaces)):
        return []
    ends = np.cumsum([0, *map(len, surfaces)])
    distance = assembly.part_distances(np.concatenate(surfaces))
    near = _TOUCH * float(np.ptp(assembly.bounds(), axis=0).max())
    everyone = [(i, j) for i in range(len(assembly)) for j in range(i + 1, len(assembly))]
    found = []
    for i, j in everyone if pairs is None else pairs:
        sides = []
        for a, b in ((i, j), (j, i)):
            some = distance[b, ends[a] : ends[a + 1]]
            if len(some):
                k = int(some.argmin())
                sides.append(Contact(a, b, float(some[k]), surfaces[a][k]))
        if sides and (pairs is not None or min(s.depth for s in sides) < near):
            found.append(min(sides, key=lambda side: side.depth))
    return found


def allowed(contact: Contact, longest: float) -> float:
    """The depth that is to be kept of a contact at the start; of a shallow one, that it touches."""
    return _KEPT * contact.depth if _KEPT * contact.depth < -_TOUCH * longest else _TOUCH * longest


def pieces_by(found: list[Contact], assembly: Assembly) -> int:
    """Into how many pieces an assembly falls by these contacts, where they reach into one another.

    Meshes join what is nearer than a cell, or do not, as the cells happen to lie. Copies of parts that touch
    nothing but copies are pieces of their own.
    """
    count = len(assembly)
    pairs = np.array([(c.a, c.b) for c in found if c.depth < 0], int).reshape(-1, 2)
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (count, count))
    total, group = connected_components(links, directed=False)
    copies = np.array([1 + len(part.instances) for part in assembly.parts])
    return int(sum(copies[group == k].min() for k in range(total)))


def contact_gradients(parameters: Parameters, found: list[Contact]) -> np.ndarray:
    """(K, D) derivative of each depth: of b's distance, and of the place, which a's surface takes along."""
    if not found:
        return np.zeros((0, len(parameters)))
    points = torch.tensor(np.array([contact.point for contact in found]), requires_grad=True)
    theta = torch.tensor(parameters.values, requires_grad=True)
    composite = Composite(parameters)
    rows = []
    for k, contact in enumerate(found):
        each = [composite.part(index, points[k : k + 1], theta) for index in (contact.a, contact.b)]
        slopes = [torch.autograd.grad(d.sum(), points, retain_graph=True)[0][k].numpy() for d in each]
        along = -(slopes[1] @ slopes[0]) / max(float(slopes[0] @ slopes[0]), 1e-12)
        (row,) = torch.autograd.grad((each[1] + along * each[0]).sum(), theta, retain_graph=True)
        rows.append(row.numpy())
    return np.array(rows)


def part_surface(assembly: Assembly, index: int) -> np.ndarray:
    """(K, 3) points of a leaf's own surface, coarse; none where it has none."""
    try:
        part = assembly.parts[index]
        if isinstance(part.field, JointField):  # a coarse mesh that all parts of its shape share
            return part.pose(part.field.preview().vertices)
        return np.asarray(mesh_part(part, _CELLS).vertices)
    except NoSurfaceError:
        return np.zeros((0, 3))
