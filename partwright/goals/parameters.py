"""All parameters of an assembly as one vector, and assemblies of other vectors."""

from __future__ import annotations

import dataclasses
import math
from typing import cast

import numpy as np

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.similarity import quaternion_product
from partwright.errors import ParameterError
from partwright.fields import Field
from partwright.fields.joint import JointField
from partwright.fields.operations import SHARP
from partwright.fields.superfrustum import SuperFrustum, tightest_bulge
from partwright.goals.entry import BLEND, MOST, POSITION, ROTATION, Entry
from partwright.goals.forms import Form, form_of
from partwright.goals.learned import LearnedForm

_HALVINGS = 6


class Parameters:
    """The numbers of an assembly's parts, in the order of its leaves: place, turn, form (or latent), blend.

    entries[i] lists those of part i; slices[i] is where they lie in vectors (D,). A turn is a rotation vector
    in the part's own frame, from where it is: R <- R exp(w), so its value is always 0. A blend of 0 stays a
    sharp edge and is no parameter. Copies of a repeated part have no numbers of their own.
    """

    def __init__(self, assembly: Assembly) -> None:
        self.assembly = assembly
        self.longest = float(np.ptp(assembly.bounds(), axis=0).max())
        if not 0 < self.longest < math.inf:
            raise ParameterError("the assembly has no end, or no size; its parts cannot be improved")
        self.forms: list[Form] = [_form(part.field) for part in assembly.parts]
        self.entries: list[list[Entry]] = []
        self.slices: list[slice] = []
        first = 0
        for part, form in zip(assembly.parts, self.forms, strict=True):
            some = [*_pose_entries(part, self.longest), *form.entries(self.longest)]
            if part.blend > SHARP:
                some.append(Entry("blend", BLEND, part.blend, self.longest, 0.02 * part.blend))
            self.entries.append(some)
            self.slices.append(slice(first, first + len(some)))
            first += len(some)
        flat = [entry for some in self.entries for entry in some]
        self.values = np.array([entry.value for entry in flat])
        self.units = np.array([entry.unit for entry in flat])
        self.lower = np.array([entry.lower for entry in flat])
        self.upper = np.array([entry.upper for entry in flat])

    def __len__(self) -> int:
        return len(self.values)

    def name(self, index: int) -> str:
        """part.parameter of an entry of vectors."""
        part = next(i for i, own in enumerate(self.slices) if index < own.stop)
        return f"{self.assembly.parts[part].name}.{self.entries[part][index - self.slices[part].start].name}"

    def with_values(self, values: np.ndarray) -> Assembly:
        """The assembly with these numbers (D,). Parts whose numbers are all the same keep their bits.

        Where a part's field does not allow its numbers (a tube without a hole), the part goes as far towards
        them as it can.
        """
        made = {
            part.name: part if np.array_equal(new := values[own], old := self.values[own]) else
            self._moved(i, part, old, new)
            for i, (part, own) in enumerate(zip(self.assembly.parts, self.slices, strict=True))
        }  # fmt: skip
        result = cast(Assembly, _replaced(self.assembly, made))
        return dataclasses.replace(result, children=result.children)

    def _moved(self, i: int, part: Part, old: np.ndarray, new: np.ndarray) -> Part:
        entries, form = self.entries[i], self.forms[i]
        blended = entries[-1].group == BLEND
        own = slice(6, len(entries) - blended)
        field = part.field if np.array_equal(old[own], new[own]) else _allowed(form, old[own], new[own])
        turn = part.rotation
        if new[3:6].any():
            turn = quaternion_product(part.rotation, rotation_of(new[3:6]))
        place = tuple(new[:3].tolist())
        if isinstance(field, JointField):
            field = _same_frame(field, part, Similarity(1.0, turn, place))
        return dataclasses.replace(
            part, field=field, translation=place, rotation=turn, blend=new[-1] if blended else part.blend
        )


def rotation_of(vector: np.ndarray) -> tuple[float, float, float, float]:
    """The unit quaternion (w, x, y, z) of a rotation vector (3,)."""
    angle = float(np.linalg.norm(vector))
    share = math.sin(angle / 2) / angle if angle > 1e-12 else 0.5
    x, y, z = (share * vector).tolist()
    return math.cos(angle / 2), x, y, z


def _form(field: Field) -> Form:
    return LearnedForm(field) if isinstance(field, JointField) else form_of(field)


def _pose_entries(part: Part, longest: float) -> list[Entry]:
    lower, upper = part.field.bounds()
    ends = np.where(np.isfinite(lower) & np.isfinite(upper), np.maximum(-lower, upper), longest)
    reach = max(float(np.linalg.norm(ends)), 1e-3 * longest)
    places = [
        Entry(f"t{axis}", POSITION, value, longest)
        for axis, value in zip("xyz", part.translation, strict=True)
    ]
    return places + [Entry(f"w{axis}", ROTATION, 0.0, min(longest / reach, MOST)) for axis in "xyz"]


def _allowed(form: Form, old: np.ndarray, new: np.ndarray) -> Field:
    for _ in range(_HALVINGS):
        try:
            field = form.field(new)
        except ParameterError:
            new = (old + new) / 2
            continue
        if isinstance(field, SuperFrustum):
            tightest = tightest_bulge(field.size[0], field.size[2])
            return dataclasses.replace(field, bulge=min(field.bulge, tightest))
        return field
    return form.field(old)


def _same_frame(field: JointField, part: Part, pose: Similarity) -> JointField:
    """A learned part tells where the frame of its shape lies: as seen from where it is now."""
    old = part.pose
    frame = Similarity(1.0, field.frame_rotation, field.frame_translation)  # type: ignore[attr-defined]
    seen = pose.inverse() @ old @ frame
    return cast(
        JointField,
        dataclasses.replace(
            field,  # type: ignore[type-var]
            frame_translation=seen.translation,
            frame_rotation=seen.rotation,
        ),
    )


def _replaced(node: Part | Assembly, made: dict[str, Part]) -> Part | Assembly:
    if node.is_part:
        return made[node.name]
    children = tuple(_replaced(child, made) for child in node.children)
    return dataclasses.replace(node, children=children)
