"""Layers, losses and network against the paper's formulas written out plainly; gradients in double."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from partwright.capri import layers, stages
from partwright.capri import quadric_rows as rows
from partwright.capri.network import (
    UNIT_TO_PAPER,
    CapriNet,
    NetworkSizes,
    distances,
    load_network,
    rows_of,
    save_network,
)
from partwright.capri.stages import STAGES, Stage
from partwright.errors import UnreadableFileError

POINTS, PRIMITIVES, CONVEXES = 50, 7, 6
TINY = NetworkSizes(primitives=12, convexes=4, code=8, hidden=16, channels=2)


def problem(seed: int = 0) -> dict[str, torch.Tensor]:
    """Values at which no entry sits on a threshold, and both sides of every clamp occur."""
    rng = np.random.default_rng(seed)
    selection = rng.uniform(-0.1, 1.1, (PRIMITIVES, CONVEXES))
    selection = np.where(rng.random(selection.shape) < 0.5, selection, 0.004)
    return {
        "coefficients": torch.from_numpy(rng.normal(size=(1, PRIMITIVES, 7))),
        "points": torch.from_numpy(rng.uniform(-0.5, 0.5, (1, POINTS, 3))),
        "selection": torch.from_numpy(selection),
        "weights": torch.from_numpy(rng.uniform(-0.2, 1.2, CONVEXES)),
        "inside": torch.from_numpy((rng.random((1, POINTS)) < 0.4).astype(float)),
    }


def loss_of(stage: Stage, given: dict[str, torch.Tensor]) -> torch.Tensor:
    distance = distances(given["coefficients"], given["points"])
    found = stages.sides(stage, distance, given["selection"], given["weights"])
    return stages.loss(stage, found, given["inside"], given["selection"], given["weights"])


def reference_loss(stage: Stage, given: dict[str, torch.Tensor]) -> float:
    """Eq. 2-14 for one point, one convex, one primitive at a time."""
    table, points, t, w, inside = (
        given[k].numpy() for k in ("coefficients", "points", "selection", "weights", "inside")
    )
    half = CONVEXES // 2
    total = 0.0
    for (x, y, z), g in zip(points[0], inside[0], strict=True):
        convexes = []
        for j in range(CONVEXES):
            value = 0.0
            for i, (a, b, c, d, e, f, k) in enumerate(table[0]):
                f_i = a * x * x + b * y * y + c * z * z + d * x + e * y + f * z + k
                chosen = float(t[i, j] > 0.01) if stage == "binary_selection" else t[i, j]
                value += max(f_i, 0.0) * chosen
            convexes.append(value)
        if stage == "weighted_union":
            left, right = (
                min(max(sum(w[j] * min(max(1 - convexes[j], 0), 1) for j in side), 0), 1)
                for side in (range(half), range(half, CONVEXES))
            )
            first = max(g, float(right < 0.5)) * (g - left) ** 2
            total += first + max(g, float(left > 0.5)) * ((1 - g) - right) ** 2
        else:
            left, right = (min(max(min(side), 0), 1) for side in (convexes[:half], convexes[half:]))
            total += max(g, float(right > 0.01)) * ((1 - g) * (1 - left) + 10 * g * left)
            total += max(g, float(left < 0.01)) * (g * (1 - right) + 2.5 * (1 - g) * right)
    total /= POINTS
    if stage != "binary_selection":
        total += sum(max(-v, 0) + max(v - 1, 0) for v in t.ravel())
    if stage == "weighted_union":
        total += sum(abs(v - 1) for v in w)
    return total


@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize("seed", range(4))
def test_losses_are_the_formulas(stage: Stage, seed: int) -> None:
    given = problem(seed)
    assert float(loss_of(stage, given)) == pytest.approx(reference_loss(stage, given), rel=1e-12)


@pytest.mark.parametrize("stage", STAGES)
def test_gradients_are_those_of_finite_differences(stage: Stage, monkeypatch) -> None:
    """Without the leak, which is no gradient of the values; T_hard has none at all."""
    monkeypatch.setattr(layers, "LEAK", 0.0)
    given = problem()
    names = {"weighted_union": ("coefficients", "selection", "weights")}.get(
        stage, ("coefficients", "selection")
    )
    moving = tuple(given[name].requires_grad_() for name in names)

    def loss(*values: torch.Tensor) -> torch.Tensor:
        return loss_of(stage, given | dict(zip(names, values, strict=True)))

    assert torch.autograd.gradcheck(loss, moving)
    (gradient,) = torch.autograd.grad(loss(*moving), moving[1:2], allow_unused=True)
    assert (gradient is None) == (stage == "binary_selection")
    assert all(bool(g.abs().max() > 1e-3) for g in torch.autograd.grad(loss(*moving), moving[:1]))


def test_the_clamp_leaks_only_what_leads_back() -> None:
    x = torch.tensor([-2.0, -2.0, 0.25, 0.25, 3.0, 3.0], requires_grad=True)
    weight = torch.tensor([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    held = layers.clamp(x)
    (held * weight).sum().backward()
    assert held.tolist() == [0, 0, 0.25, 0.25, 1, 1]
    assert x.grad is not None
    assert x.grad.tolist() == pytest.approx([0, -1e-3, 1, -1, 1e-3, 0])


def test_a_point_deep_inside_a_convex_can_carve_it() -> None:
    distance = torch.tensor([[[-0.5, -0.5, 0.25]]], requires_grad=True)
    for sign, wanted in ((-1.0, [-1e-3, -1e-3, -1]), (1.0, [0, 0, 1])):
        (gradient,) = torch.autograd.grad(
            sign * layers.intersection(distance, torch.ones(3, 1), leaks=True).sum(), distance
        )
        assert gradient.flatten().tolist() == pytest.approx(wanted)
    (gradient,) = torch.autograd.grad(-layers.intersection(distance, torch.ones(3, 1)).sum(), distance)
    assert gradient.flatten().tolist() == [0, 0, -1]


def test_a_drilled_slab_by_hand() -> None:
    """|x| < 0.4, |y| < 0.4 minus a cylinder of radius 0.2 along z: both unions and both differences agree."""
    table = torch.tensor(
        [[0, 0, 0, s * a, s * b, 0, -0.4] for a, b in ((1.0, 0), (0, 1.0)) for s in (1, -1)]
        + [[1, 1, 0, 0, 0, 0, -0.04]]
    )[None]
    selection = torch.zeros(5, 2)
    selection[:4, 0] = selection[4, 1] = 50.0
    points = torch.from_numpy(np.random.default_rng(0).uniform(-0.5, 0.5, (1, 4000, 3))).float()
    x, y, _ = points[0].T
    inside = (x.abs() < 0.4) & (y.abs() < 0.4) & (x * x + y * y > 0.04)
    sure = ((x.abs() - 0.4).abs() > 0.03) & ((y.abs() - 0.4).abs() > 0.03) & ((x.hypot(y) - 0.2).abs() > 0.1)
    distance = distances(table, points)
    convexes = layers.intersection(distance, selection)[0]
    exact = layers.difference_exact(layers.union_exact(convexes[:, :1]), layers.union_exact(convexes[:, 1:]))
    soft = layers.difference_weighted(
        layers.union_weighted(convexes[:, :1], torch.ones(1)),
        layers.union_weighted(convexes[:, 1:], torch.ones(1)),
    )
    assert torch.equal((exact == 0)[sure], inside[sure])
    assert torch.equal((soft > 0.5)[sure], inside[sure])
    found = stages.sides("exact_union", distance, selection, torch.ones(2))
    assert float(stages.exact_loss(found, inside[None].float())) < 0.5
    wrong = stages.exact_loss(found, 1 - inside[None].float())
    assert float(wrong) > 2


def test_primitives_are_rows_of_the_unit_frame() -> None:
    torch.manual_seed(0)
    network = CapriNet(TINY).double()
    coefficients = network.coefficients(torch.rand(1, TINY.code, dtype=torch.double))
    assert coefficients.shape == (1, 12, 7)
    assert bool((coefficients[..., :3] >= 0).all())
    points = np.random.default_rng(0).uniform(-1, 1, (100, 3))
    given = distances(coefficients, torch.from_numpy(UNIT_TO_PAPER * points)[None])[0].detach().numpy()
    np.testing.assert_allclose(rows.values(rows_of(coefficients[0]), points), given, atol=1e-12)


def test_seeded_primitives_are_the_rows_given() -> None:
    torch.manual_seed(0)
    network = CapriNet(TINY)
    given = np.stack(
        [
            rows.plane((0.0, 0.6, 0.8), 0.3),
            rows.sphere((0.1, 0, 0), 0.5),
            rows.cylinder((0, 0, 0), (0, 0, 1), 0.2),
        ]
    )
    tilted = rows.cylinder((0, 0, 0), np.array([1, 1, 0]) / 2**0.5, 0.2)
    code = torch.rand(1, TINY.code)
    assert rows.expressible(np.stack([tilted, -given[1], *given])).tolist() == [
        False,
        False,
        True,
        True,
        True,
    ]
    network.seed(given, code)
    made = rows_of(network.coefficients(code)[0])[:3]
    np.testing.assert_allclose(made, given, atol=1e-6)


def test_codes_of_voxels() -> None:
    network = CapriNet(TINY)
    voxels = torch.zeros(2, 1, 64, 64, 64)
    voxels[0, 0, 20:40, 20:40, 20:40] = 1
    voxels[1, 0, 10:50, 30:34, 20:60] = 1
    codes = network.encoder(voxels)
    assert codes.shape == (2, TINY.code)
    assert float((codes[0] - codes[1]).detach().abs().max()) > 1e-4
    assert sum(p.numel() for p in CapriNet(NetworkSizes()).primitives.parameters()) == 257 * 512 + 513 * 7168


def test_files_keep_the_network_to_half_precision(tmp_path) -> None:
    network = CapriNet(TINY)
    for half, accuracy in ((True, 1e-3), (False, 0.0)):
        save_network(network, tmp_path / "n.safetensors", half)
        back = load_network(tmp_path / "n.safetensors")
        assert back.sizes == TINY
        for a, b in zip(network.state_dict().values(), back.state_dict().values(), strict=True):
            assert float((a - b).abs().max()) <= accuracy * float(a.abs().max())
    assert (tmp_path / "n.safetensors").stat().st_size < 400_000


@pytest.mark.parametrize("content", [b"", b"nonsense", None], ids=["empty", "nonsense", "missing"])
def test_other_files_are_no_network(tmp_path, content: bytes | None) -> None:
    path = tmp_path / "n.safetensors"
    if content is not None:
        path.write_bytes(content)
    message = "no such file; check the path" if content is None else "is no CAPRI network"
    with pytest.raises(UnreadableFileError, match=message):
        load_network(path)
