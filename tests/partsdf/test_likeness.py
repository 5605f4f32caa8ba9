"""Pictures of the family, told from those of heaps."""

from __future__ import annotations

import numpy as np
import pytest
import torch
import trimesh

from partwright.partsdf.encoder import EncoderSettings
from partwright.partsdf.image_encoder import ImageNetwork, ImageSettings
from partwright.partsdf.lighting import before_clutter, lit
from partwright.partsdf.likeness import draw_heaps, learn_likeness
from partwright.partsdf.poses import PoseTensors, identity
from partwright.partsdf.views import EACH, PartMeshes, Views, views_of

SMALL = ImageSettings((16, 16, 32), EncoderSettings(width=32, heads=2, rounds=1, blocks=1, beside=2))


COUNT = 64 * EACH


@pytest.fixture(scope="module")
def network() -> ImageNetwork:
    """As it begins: even filters that have learned nothing tell rods from heaps."""
    torch.manual_seed(0)
    return ImageNetwork(1, 8, SMALL).requires_grad_(False).eval()


def rods(seed: int) -> Views:
    """A family of upright rods, thick and thin."""
    random, rod = torch.Generator().manual_seed(seed), trimesh.creation.box((2, 2, 2))
    poses = identity(1).map(lambda t: t.expand(COUNT // EACH, *t.shape))
    thick = 0.05 + 0.1 * torch.rand(COUNT // EACH, 1, 2, generator=random)
    poses = PoseTensors(poses.translation, poses.rotation, torch.cat([thick, poses.scale[..., 2:]], dim=-1))
    one = torch.zeros(COUNT // EACH, 1, dtype=torch.long)
    meshes = PartMeshes([[rod.vertices]], [[rod.faces]])
    return views_of(meshes, "z", one, poses, one == 0, COUNT, random)


def likeness(network: ImageNetwork, seen: Views) -> np.ndarray:
    rows = torch.arange(len(seen.label))
    pictures, _ = lit(seen, rows, torch.Generator().manual_seed(9))
    return network.known(network.features(*network.scales(pictures)[1:]))[:, 0].numpy()


def test_heaps_are_told_from_the_family(network: ImageNetwork) -> None:
    """Views that it did not learn from; all that the network knew stays to the bit."""
    before = {name: value.clone() for name, value in network.state_dict().items()}
    learn_likeness(network, rods(0), "z", torch.Generator().manual_seed(1))
    changed = [name for name, value in network.state_dict().items() if not value.equal(before[name])]
    assert changed == ["known.weight", "known.bias"]
    own = likeness(network, rods(2))
    heaps = likeness(network, draw_heaps("z", COUNT, torch.Generator().manual_seed(3)))
    assert (own[:, None] > heaps).mean() > 0.7  # 0.5 by chance


def test_heaps_are_of_one_to_eight_solids() -> None:
    heaps = draw_heaps("y", 100, torch.Generator().manual_seed(0))
    assert len(heaps.label) == 100
    assert heaps.present.sum(dim=1).unique().tolist() == [1, 2, 3, 4, 5, 6, 7, 8]
    seen = (heaps.label > 0).flatten(1).float().mean(dim=1)
    assert seen.min() > 0
    assert heaps.donors.unique().tolist() == [0, 1, 2, 3, 4]


def test_clutter_is_behind_half_of_the_shapes() -> None:
    random = torch.Generator().manual_seed(0)
    pictures = torch.full((400, 3, 64, 64), 0.5)
    silhouette = torch.zeros(400, 64, 64)
    silhouette[:, 20:40, 10:30] = 1
    seen = before_clutter(pictures, silhouette, random)
    there = (silhouette > 0)[:, None].expand_as(seen)
    assert (seen[there] == 0.5).all()
    changed = ((seen != 0.5) & ~there).flatten(1).any(dim=1)
    assert 0.4 < float(changed.float().mean()) < 0.6
    assert 0.0 <= float(seen.min()) < float(seen.max()) <= 1.0
