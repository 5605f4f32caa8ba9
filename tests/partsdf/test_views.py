"""Pictures that an encoder learns from: parts as their poses say, in changing light."""

from __future__ import annotations

import pytest
import torch

from partwright.datasets.prepared import PreparedFamily
from partwright.methods import Cancellation
from partwright.partsdf.lighting import lit
from partwright.partsdf.model import Model
from partwright.partsdf.views import SHADED, SIDE, PartMeshes, draw_views


@pytest.fixture(scope="module")
def saved(model: Model, tmp_path_factory: pytest.TempPathFactory) -> Model:
    """The model, from a file of its own."""
    return model.save(tmp_path_factory.mktemp("seen") / "lamps.safetensors")


def test_views_see_the_parts_where_their_poses_say(
    saved: Model, lamps: PreparedFamily, monkeypatch: pytest.MonkeyPatch
) -> None:
    meshes = PartMeshes.of(lamps, saved)
    views = draw_views(meshes, saved, 80, torch.Generator().manual_seed(0))
    monkeypatch.setattr("partwright.partsdf.views._WORTH", 10)
    again = draw_views(meshes, saved, 80, torch.Generator().manual_seed(0), workers=2)
    assert all(torch.equal(a, b) for a, b in zip(views.poses, again.poses, strict=True))
    for name in ("normal", "label", "light", "back", "camera", "donors", "present"):
        assert torch.equal(getattr(views, name), getattr(again, name))
    cancel = Cancellation()
    few = draw_views(meshes, saved, 80, torch.Generator().manual_seed(0), lambda _: cancel.request(), cancel)
    assert torch.equal(few.label, views.label[: len(few.label)])
    assert len(few.label) == len(few.donors) == 4
    assert len(views.label) == 80
    part = (views.label % SHADED).long()
    assert part.max() == 3
    # A knob is seen only where there is one, and hardly anywhere where it is all hidden.
    knob = (part == 3).flatten(1).any(dim=1)
    assert not knob[~views.present[:, 2]].any()
    assert knob[views.present[:, 2]].float().mean() > 0.7
    # Surfaces that are seen face the viewer; the ball's is a sphere, so what is seen of it bulges to there.
    seen = part > 0
    toward = (views.normal.float() / 127 * views.back[:, None, None]).sum(-1)
    assert toward[seen].min() > -0.5
    assert (toward[seen] > 0).float().mean() > 0.95
    ball = (views.normal.float() / 127 * (part == 2)[..., None]).flatten(1, 2).sum(1)
    open_ones = (part == 2).flatten(1).sum(1) > 200
    assert open_ones.sum() > 20
    along = (torch.nn.functional.normalize(ball, dim=1) * views.back).sum(1)[open_ones]
    assert along.median() > 0.9
    # In the unit frame: the plate's half-length is that of the whole along x.
    longest = views.poses.scale[:, 0].amax(dim=1)
    assert ((longest - 0.9).abs() < 0.02).float().mean() > 0.5
    azimuth = torch.atan2(views.camera[:, 1], views.camera[:, 0])
    torch.testing.assert_close(
        views.back[:, :2],
        views.camera[:, 2:].cos() * torch.stack([azimuth.sin(), -azimuth.cos()], dim=1),
        atol=1e-5,
        rtol=0,
    )


def test_light_and_colour_change_and_the_silhouette_does_not(saved: Model, lamps: PreparedFamily) -> None:
    views = draw_views(PartMeshes.of(lamps, saved), saved, 8, torch.Generator().manual_seed(1))
    generator = torch.Generator().manual_seed(2)
    one, silhouette = lit(views, torch.arange(8), generator)
    other, same = lit(views, torch.arange(8), generator)
    assert one.shape == (8, 3, SIDE, SIDE)
    assert one.min() >= 0
    assert one.max() <= 1
    assert torch.equal(silhouette, same)
    assert torch.equal(silhouette > 0, views.label % SHADED > 0)
    assert ((one - other).abs().mean(dim=(1, 2, 3)) > 0.03).all()
