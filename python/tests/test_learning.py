# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""tetwarp.torch: operators that PyTorch accepts, gradients that are right, the same bits everywhere."""

from __future__ import annotations

import json
import os
import pathlib
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

import tetwarp as tw

torch: Any = pytest.importorskip("torch", reason="PyTorch is not installed")
if not hasattr(torch.library, "custom_op"):
    pytest.skip(f"PyTorch {torch.__version__} is older than 2.4", allow_module_level=True)
import tetwarp.torch as tt  # noqa: E402

DEVICES = ["cpu"] + (["cuda"] if torch.cuda.is_available() and tw.features()["devices"] else [])


def scene(samples=2, channels=1, shape=(9, 10, 11), cell=4, amplitude=0.5, seed=1, dtype=torch.float32):
    """A batch of random volumes, and displacements in steps of 2^-12 voxel."""
    random = np.random.default_rng(seed)
    volume = torch.from_numpy(random.standard_normal((samples, channels, *shape))).to(dtype)
    moved = random.uniform(-amplitude, amplitude, (samples, 3, *tt.lattice_shape(shape, cell)))
    return volume, torch.from_numpy(np.round(moved * 4096) / 4096).to(torch.float32)


def gradients(volume, displacement, weights=None, **options):
    volume, displacement = volume.detach().requires_grad_(), displacement.detach().requires_grad_()
    result = tt.deform(volume, displacement, outside="background", **options)
    weights = torch.linspace(-1, 1, result.numel(), device=result.device).view(result.shape) if weights is None else weights
    result.backward(weights.to(result.dtype))
    return result.detach(), volume.grad, displacement.grad


@pytest.mark.parametrize("device", DEVICES)
def test_gives_the_bits_of_the_library(device):
    volume, displacement = scene(channels=2)
    grid = tw.Geometry((11, 10, 9), spacing=(0.9, 0.8, 2.0), origin=(3, -5, 7))
    lattice = grid.lattice(4)
    got = tt.deform(
        volume.to(device), displacement.to(device), geometry=grid, lattice=4, outside="background", background=-3
    ).cpu()
    for sample in range(2):
        field = tw.VertexField(lattice, np.ascontiguousarray(displacement[sample].permute(1, 2, 3, 0).numpy()))
        for channel in range(2):
            one = tw.Volume(volume[sample, channel].numpy(), grid)
            expected = tw.deform(one, field, outside="background", background=-3, backend="cpu").volume.array
            assert np.array_equal(got[sample, channel].numpy(), expected)


@pytest.mark.parametrize("device", DEVICES)
def test_the_volumes_gradient_is_the_transpose(device):
    volume, displacement = scene(samples=1, channels=3, dtype=torch.float64)
    volume, displacement = volume.to(device), displacement.to(device)
    weights = torch.randn(volume.shape, dtype=torch.float64, device=device, generator=torch.Generator(device).manual_seed(3))
    result, of_volume, _ = gradients(volume, displacement, weights, lattice=4)
    forward, back = (result * weights).sum(), (of_volume * volume).sum()
    assert abs(forward - back) <= 1e-6 * result.norm() * weights.norm()


@pytest.mark.parametrize("device", DEVICES)
def test_gradcheck(device):
    volume, displacement = scene(samples=1, shape=(5, 5, 6), cell=4, amplitude=0.3, dtype=torch.float64)
    volume, displacement = volume.to(device).requires_grad_(), displacement.to(device).double()

    def of_volume(v):
        return tt.deform(v, displacement, lattice=4, outside="background")

    assert torch.autograd.gradcheck(of_volume, (volume,))

    # A volume that is affine has the same slope everywhere, so that no voxel passes a place where it jumps.
    k, j, i = torch.meshgrid(*(torch.arange(n, dtype=torch.float64) for n in (5, 5, 6)), indexing="ij")
    affine = (2 * i - j + 3 * k)[None, None].to(device) / 8  # so flat that the second derivative does not show
    inside = torch.zeros(1, 1, 5, 5, 6, dtype=torch.float64, device=device)
    inside[..., 1:4, 1:4, 1:5] = 1  # not what comes to be covered

    def of_displacement(d):
        return tt.deform(affine, d, lattice=4, outside="background") * inside

    still = torch.zeros_like(displacement).requires_grad_()
    assert torch.autograd.gradcheck(of_displacement, (still,), eps=2.0**-6, atol=1e-3)


@pytest.mark.parametrize("device", DEVICES)
def test_opcheck(device):
    volume, displacement = scene(shape=(5, 6, 7))
    volume, displacement = volume.to(device), displacement.to(device)
    field = (None, None, None, None, [4.0], [], [], "linear", "background")
    for needs in ((True, True), (True, False), (False, True)):
        inputs = volume.clone().requires_grad_(needs[0]), displacement.clone().requires_grad_(needs[1])
        torch.library.opcheck(torch.ops.tetwarp.deform, (*inputs, *field, 0.0))
        torch.library.opcheck(
            torch.ops.tetwarp.deform_backward, (volume, volume, list(volume.shape[2:]), *needs, displacement, *field)
        )


UNEVEN = tw.Geometry((7, 6, 4), spacing=(1, 1, 2), slices=[0, 1, 2, 6])


def test_uneven_slices_go_onto_a_straight_grid():
    volume = torch.rand(1, 1, *UNEVEN.shape)
    shape = UNEVEN.straightened().shape
    displacement = torch.zeros(1, 3, *tt.lattice_shape(shape, 4))
    assert tuple(displacement.shape[2:]) == UNEVEN.lattice(4).shape
    straight = list(UNEVEN.straightened()._numbers)
    field = (None, None, None, None, [4.0], list(UNEVEN._numbers), straight, "linear", "background")
    torch.library.opcheck(torch.ops.tetwarp.deform, (volume.requires_grad_(), displacement.requires_grad_(), *field, 0.0))
    got = tt.deform(volume, displacement, lattice=4, geometry=UNEVEN, outside="background")
    assert tuple(got.shape[2:]) == shape != UNEVEN.shape


@pytest.mark.parametrize("device", DEVICES)
def test_same_bits_on_every_run_and_beside_any_batch_mate(device):
    volume, displacement = scene(samples=3, channels=2, seed=5)
    expected = gradients(volume, displacement, lattice=4)
    weights = torch.linspace(-1, 1, volume.numel()).view(volume.shape)
    for _ in range(10):
        got = gradients(volume.to(device), displacement.to(device), lattice=4)
        assert all(torch.equal(a, b.cpu()) for a, b in zip(expected, got))
    volume[0] *= 1e6
    weights[2] = float("nan")
    got = gradients(volume.to(device), displacement.to(device), weights.to(device), lattice=4)
    assert all(torch.equal(a[1], b[1].cpu()) for a, b in zip(expected, got))
    assert got[1][2].isnan().all() and got[2][2].isnan().all()
    assert not torch.equal(expected[2][0], got[2][0].cpu())


@pytest.mark.parametrize("device", DEVICES)
def test_compiles_without_graph_breaks(device):
    volume, displacement = scene()
    volume, displacement = volume.to(device), displacement.to(device)
    grid = tw.Geometry((11, 10, 9), spacing=(1, 1, 2))
    lattice = tw.Geometry((11, 10, 9)).lattice(4)
    field = tw.VertexField(lattice, np.zeros((*lattice.shape, 3), np.float32))

    def loss(v, d):
        moved = tt.deform(v * 1.5, d, lattice=4, geometry=grid, outside="background")
        other = tt.deform(v, d, lattice=lattice, outside="rest").mean() + tt.deform(v, d, lattice=field, outside="rest").mean()
        return moved.square().mean() + other

    compiled = torch.compile(loss, fullgraph=True, backend="aot_eager")
    results = []
    for function in (loss, compiled):
        v, d = volume.clone().requires_grad_(), displacement.clone().requires_grad_()
        value = function(v, d)
        value.backward()
        results.append((value.detach(), v.grad, d.grad))
    for a, b in zip(*results):
        assert torch.equal(a, b)


def test_vmap():
    if not hasattr(torch.library, "register_vmap"):
        pytest.skip("vmap of custom operators came with PyTorch 2.5")
    volume, displacement = scene(samples=6)
    volume, displacement = volume.unflatten(0, (3, 2)), displacement.unflatten(0, (3, 2))

    def moved(v, d):
        return tt.deform(v, d, lattice=4, outside="background")

    got = torch.vmap(moved)(volume, displacement)
    assert torch.equal(got, torch.stack([moved(v, d) for v, d in zip(volume, displacement)]))
    one = torch.vmap(moved, in_dims=(None, 0))(volume[0], displacement)
    assert torch.equal(one, torch.stack([moved(volume[0], d) for d in displacement]))

    v, d = volume[0].clone().requires_grad_(), displacement[0].clone().requires_grad_()
    result = moved(v, d)
    weights = torch.randn(3, *result.shape, generator=torch.Generator().manual_seed(4))
    batched = torch.autograd.grad(result, (v, d), weights, is_grads_batched=True, retain_graph=True)
    for n in range(3):
        expected = torch.autograd.grad(result, (v, d), weights[n], retain_graph=True)
        assert torch.equal(batched[0][n], expected[0]) and torch.equal(batched[1][n], expected[1])


@pytest.mark.parametrize("device", DEVICES)
def test_types(device):
    volume, displacement = scene()
    volume, displacement = volume.to(device), displacement.to(device)
    exact = gradients(volume, displacement, lattice=4)
    for kind in (torch.float16, torch.bfloat16):
        coarse = volume.to(kind)
        result, of_volume, of_displacement = gradients(coarse, displacement, lattice=4)
        assert result.dtype == of_volume.dtype == kind and of_displacement.dtype == torch.float32
        weights = torch.linspace(-1, 1, volume.numel(), device=device).view(volume.shape).to(kind).float()
        expected = gradients(coarse.float(), displacement, weights, lattice=4)
        assert torch.equal(result, expected[0].to(kind))
        assert torch.equal(of_volume, expected[1].to(kind))
        assert torch.equal(of_displacement, expected[2])
    double = gradients(volume.double(), displacement.double(), lattice=4)
    assert [one.dtype for one in double] == [torch.float64] * 3
    for one, other in zip(exact, double):
        assert torch.allclose(one, other.float(), atol=1e-5)
    labels = (volume * 10).to(torch.uint8)
    voted = tt.deform(labels, displacement, lattice=4, interpolation="vote", outside="background")
    assert voted.dtype == torch.uint8 and set(voted.unique().tolist()) <= {*labels.unique().tolist(), 0}
    with torch.autocast(device, dtype=torch.bfloat16):
        assert tt.deform(volume, displacement, lattice=4, outside="background").dtype == torch.float32


def test_meshes_and_replaced_cells():
    grid = tw.Geometry((11, 10, 9))
    corners = np.array([[i, j, k] for k in (-1, 12) for j in (-1, 12) for i in (-1, 12)], np.float64)
    tetrahedra = np.array([[0, 1, 2, 4], [1, 2, 4, 7], [1, 3, 2, 7], [1, 4, 5, 7], [2, 6, 4, 7]], np.uint32)
    mesh = tw.TetrahedralMesh(corners, np.zeros((8, 3), np.float32), tetrahedra)
    volume, _ = scene()
    moved = torch.from_numpy(np.random.default_rng(7).uniform(-0.4, 0.4, (2, 3, 8))).float()
    result, of_volume, of_displacement = gradients(volume, moved, lattice=mesh)
    for sample in range(2):
        field = tw.VertexField(None, None, tw.TetrahedralMesh(corners, moved[sample].T.numpy(), tetrahedra))
        one = tw.Volume(volume[sample, 0].numpy(), grid)
        expected = tw.deform(one, field, outside="background", background=0, backend="cpu").volume.array
        assert np.array_equal(result[sample, 0].numpy(), expected)
    assert of_displacement.shape == moved.shape and of_displacement.abs().max() > 0
    lattice = grid.lattice(4)
    count = int(np.prod(lattice.size))
    # The mesh takes the place of the first cell, by the same tetrahedra, so nothing changes but who gets the gradient.
    cell = np.array([[4 * (c & 1), 4 * (c >> 1 & 1), 4 * (c >> 2)] for c in range(8)], np.float64)
    divided = tw.VertexField(
        lattice, np.zeros((*lattice.shape, 3), np.float32),
        tw.TetrahedralMesh(cell, np.zeros((8, 3), np.float32), np.array([[0, 1, 2, 4], [1, 2, 4, 7], [1, 3, 2, 7], [1, 4, 5, 7], [2, 6, 4, 7]], np.uint32)),
        np.array([0], np.uint64),
    )  # fmt: skip
    moved = torch.zeros(2, 3, count + 8)
    result, _, of_displacement = gradients(volume, moved, lattice=divided)
    assert torch.equal(result, volume)
    assert of_displacement[:, :, count:].abs().sum() > 0 and (of_displacement[:, :, 0] == 0).all()


def test_refuses_what_does_not_fit():
    volume, displacement = scene()
    cases = [
        (dict(volume=volume[0]), "expected (N, C, D, H, W)"),
        (dict(volume=volume.bool()), "torch.bool"),
        (dict(displacement=displacement[:, :, 1:]), "expected (2, 3, 3, 4, 4)"),
        (dict(displacement=displacement.int()), "expected float32"),
        (dict(lattice=3), "expected (2, 3, 4, 4, 5)"),
        (dict(lattice=0), "cell_size"),
        (dict(geometry=tw.Geometry((4, 4, 4))), "its geometry (4, 4, 4)"),
        (dict(interpolation="best"), "interpolation"),
        (dict(outside="gone"), "outside"),
        (dict(displacement=displacement.clone().requires_grad_(), interpolation="cubic"), "cubic"),
        (dict(volume=volume.clone().requires_grad_(), interpolation="vote"), "vote"),
        (dict(volume=volume.to(torch.int16), displacement=displacement.clone().requires_grad_()), "torch.int16"),
    ]
    for change, words in cases:
        options = dict(volume=volume, displacement=displacement, lattice=4, outside="background") | change
        with pytest.raises(tw.InputError) as error:
            tt.deform(options.pop("volume"), options.pop("displacement"), **options)
        assert words in str(error.value)
    for lattice in (4.0, True, None):
        with pytest.raises(TypeError, match="lattice is a"):
            tt.deform(volume, displacement, lattice=lattice)
    folded = displacement * float("nan")
    with pytest.raises(tw.InputError, match="finite"):
        tt.deform(volume, folded, lattice=4)
    assert torch.equal(tt.deform(volume, displacement * 0, lattice=4), volume)  # a failed call spoils no other


def test_a_second_derivative_is_refused_by_name():
    volume, displacement = scene()
    displacement.requires_grad_()
    loss = tt.deform(volume, displacement, lattice=4, outside="background").square().sum()
    (first,) = torch.autograd.grad(loss, displacement, create_graph=True)
    with pytest.raises(RuntimeError, match="deform_backward"):
        first.sum().backward()


def test_computes_only_what_is_asked_for():
    volume, displacement = scene()
    result = tt.deform(volume.clone().requires_grad_(), displacement, lattice=4, outside="background")
    saved = [one for one in result.grad_fn.saved_tensors if one is not None] if hasattr(result.grad_fn, "saved_tensors") else []
    assert all(one.shape != volume.shape for one in saved)
    result.sum().backward()
    assert displacement.grad is None
    assert not tt.deform(volume, displacement, lattice=4, outside="background").requires_grad


def test_descent_leaves_the_identity():
    k, j, i = torch.meshgrid(*(torch.arange(24.0) for _ in range(3)), indexing="ij")
    ball = lambda x: torch.exp(-((i - x) ** 2 + (j - 12) ** 2 + (k - 12) ** 2) / 40)[None, None]  # noqa: E731
    fixed, moving = ball(13.5), ball(11.0)
    displacement = torch.zeros(1, 3, *tt.lattice_shape((24, 24, 24), 4), requires_grad=True)
    optimiser = torch.optim.Adam([displacement], 0.1)
    losses = []
    for _ in range(40):
        optimiser.zero_grad()
        moved = tt.deform(moving, displacement, lattice=4, outside="background")
        loss = (moved - fixed).square().mean()
        loss.backward()
        optimiser.step()
        losses.append(float(loss.detach()))
    assert losses[-1] < 0.05 * losses[0]


def register(moving, fixed, output, *options):
    script = pathlib.Path(__file__).resolve().parents[2] / "examples" / "learning" / "register.py"
    done = subprocess.run(
        [sys.executable, script, moving, fixed, "-o", output, *options], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads((output / "report.json").read_text())


@pytest.mark.parametrize("device", DEVICES)
def test_the_registration_example_finds_a_phantoms_motion_by_the_same_bits_each_time(device, tmp_path):
    moving = tw.phantom((48, 40, 36), spacing=(4, 4, 4))
    motion = tw.fields.wave(moving.geometry, amplitude=6, wavelength=120, cell_size=4)
    tw.write(moving, tmp_path / "moving.nii.gz")
    tw.write(tw.deform(moving, motion, outside="rest").volume, tmp_path / "fixed.nii.gz")
    fields = []
    for name in ("one", "two"):
        report = register(
            tmp_path / "moving.nii.gz", tmp_path / "fixed.nii.gz", tmp_path / name, "--device", device, "--cells", "16,8",
            "--steps", "30,30", "--rates", "1,0.5",
        )  # fmt: skip
        assert report["mean_squared_error"] < 0.3 * report["mean_squared_error_before"]
        assert report["inverted"] == 0
        fields.append((tmp_path / name / "field.mha").read_bytes())
    assert fields[0] == fields[1]


@pytest.mark.parametrize("device", DEVICES)
def test_the_registration_example_is_as_near_as_plastimatchs_splines(device, tmp_path):
    data = pathlib.Path(os.environ.get("TETWARP_TEST_DATA", "")) / "lung-4dct-t0-t5"
    if not (data / "t0.mha").exists():
        pytest.skip("no series of phases of a breath; TETWARP_TEST_DATA names a folder that has one")
    report = register(data / "t0.mha", data / "t5.mha", tmp_path, "--device", device)
    assert report["mean_squared_error"] <= 604  # HU squared, of plastimatch's B-spline on this pair
    assert report["inverted"] == 0
    assert report["seconds"] < (60 if device == "cuda" else 600)


def test_the_segmentation_example_makes_its_curves(tmp_path):
    script = pathlib.Path(__file__).resolve().parents[2] / "examples" / "learning" / "segment.py"
    command = [sys.executable, script, "-o", tmp_path, "--steps", "20", "--tests", "1"]
    assert subprocess.run(command, check=False).returncode == 0
    lines = (tmp_path / "curves.csv").read_text().splitlines()
    assert lines[0] == "step,without deformations,with deformations"
    first, last = ([float(value) for value in line.split(",")[1:]] for line in (lines[1], lines[-1]))
    assert first[0] == first[1] and all(after > before for before, after in zip(first, last))


def test_a_fork_amid_another_threads_call_hangs_nobody():
    script = """
import os, sys, torch, tetwarp.torch as tt
volume, moved = torch.rand(1, 1, 9, 9, 9), torch.zeros(1, 3, 3, 3, 3)
torch.set_num_threads(1)
tt.deform(volume, moved, lattice=4)
tt._resamplers._lock.acquire()  # as another thread may hold it
child = os.fork()
if child == 0:
    os._exit(0 if torch.equal(tt.deform(volume, moved, lattice=4), volume) else 1)
sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
    assert subprocess.run([sys.executable, "-c", script], timeout=60, check=False).returncode == 0
