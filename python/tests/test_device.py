# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Arrays on a CUDA device: used where they lie, given back in the library of the question, ordered on its stream."""

import numpy as np
import pytest
import tetwarp as tw

if not tw.features()["devices"]:
    pytest.skip("no CUDA device", allow_module_level=True)

GRID = tw.Geometry((61, 52, 43), (1.5, 2.0, 2.5), (-40, 10, 5))


class Torch:
    def __init__(self):
        self.library = pytest.importorskip("torch")
        if not self.library.cuda.is_available():
            pytest.skip("PyTorch has no CUDA")

    def on_device(self, array):
        return self.library.as_tensor(array, device="cuda")

    def pointer(self, array):
        return array.data_ptr()

    def on_host(self, array):
        return array.cpu().numpy()

    def taken(self, array):
        return self.library.from_dlpack(array)


class CuPy:
    def __init__(self):
        self.library = pytest.importorskip("cupy")

    def on_device(self, array):
        return self.library.asarray(array)

    def pointer(self, array):
        return array.data.ptr

    def on_host(self, array):
        return self.library.asnumpy(array)

    def taken(self, array):
        return self.library.from_dlpack(array)


class Jax:
    def __init__(self):
        self.library = pytest.importorskip("jax")
        devices = [one for one in self.library.devices() if one.platform == "gpu"]
        if not devices:
            pytest.skip("JAX has no CUDA")
        self.device = devices[0]

    def on_device(self, array):
        return self.library.device_put(array, self.device)

    def pointer(self, array):
        return array.unsafe_buffer_pointer()

    def on_host(self, array):
        return np.asarray(array)

    def taken(self, array):
        return self.library.dlpack.from_dlpack(array)


@pytest.fixture(params=[Torch, CuPy, Jax])
def arrays(request):
    return request.param()


@pytest.fixture(scope="module")
def source():
    return np.random.default_rng(5).integers(-1000, 2000, GRID.shape, dtype=np.int16)


@pytest.fixture(scope="module")
def field():
    return tw.fields.elastic(GRID, amplitude=6, spacing=25, seed=4, cell_size=3)


@pytest.fixture(scope="module")
def expected(source, field):
    return tw.deform(
        tw.Volume(source, GRID), field, outside="background", background=-1024, backend="cpu",
        maps=("coverage", "inverse", "jacobian", "folds"),
    )


def test_what_lies_on_the_device_gives_the_bits_of_the_cpu(arrays, source, field, expected):
    volume = tw.Volume(arrays.on_device(source), GRID)
    there = tw.VertexField(field.lattice, arrays.on_device(field.displacement))
    done = tw.deform(volume, there, outside="background", background=-1024, maps=("coverage", "inverse", "jacobian", "folds"))
    assert done.report.backend == "cuda"
    assert type(done.volume.array) is type(volume.array)
    assert arrays.on_host(done.volume.array).tobytes() == expected.volume.array.tobytes()
    for name, made in done.maps.items():
        assert arrays.on_host(made.array).tobytes() == expected.maps[name].array.tobytes(), name
    assert arrays.on_host(volume.array).tobytes() == source.tobytes()


def test_nothing_is_copied(arrays, source, field):
    if isinstance(arrays, Jax):
        pytest.skip("arrays of JAX do not change, so none can be given to take a result")
    volume = tw.Volume(arrays.on_device(source), GRID)
    out = arrays.on_device(np.zeros(GRID.shape, np.int16))
    done = tw.deform(volume, field, outside="background", out=out)
    assert arrays.pointer(done.volume.array) == arrays.pointer(out)
    assert arrays.on_host(out).any()


def test_host_and_device_may_be_mixed(arrays, source, field, expected):
    labels = tw.Volume((source > 0).astype(np.uint8), GRID)
    done = tw.deform(
        tw.Volume(arrays.on_device(source), GRID), field, outside="background", background=-1024, backend="cuda",
        with_=[tw.Along(labels, interpolation="vote")],
    )
    host = tw.deform(labels, field, outside="background", interpolation="vote", backend="cpu")
    assert done.volumes[0].array.tobytes() == host.volume.array.tobytes()
    assert arrays.on_host(done.volume.array).tobytes() == expected.volume.array.tobytes()


def test_work_waits_for_what_is_queued_on_the_stream(source, field, expected):
    torch = Torch().library
    values = torch.as_tensor(source, device="cuda")
    warp = tw.Resampler(GRID, backend="cuda")
    warp.set_field(field, outside="background")
    for stream in (torch.cuda.Stream(), torch.cuda.default_stream()):
        late = torch.zeros_like(values)
        torch.cuda.synchronize()
        with torch.cuda.stream(stream):
            torch.cuda._sleep(200_000_000)  # cycles, about 0.1 s
            late.copy_(values)
            volume = tw.Volume(late, GRID)
            volume.background = -1024.0
            result = warp.resample([volume])[0][0].array
        assert result.cpu().numpy().tobytes() == expected.volume.array.tobytes()


def test_another_stream_may_be_named(source, field, expected):
    torch = Torch().library
    stream = torch.cuda.Stream()
    volume = tw.Volume(torch.as_tensor(source, device="cuda"), GRID)
    volume.background = -1024.0
    warp = tw.Resampler(GRID, backend="cuda")
    for named in (stream, stream.cuda_stream):
        warp.set_field(field, outside="background", stream=named)
        result = warp.resample([volume], stream=named)[0][0].array
        assert result.cpu().numpy().tobytes() == expected.volume.array.tobytes()


def test_the_cpu_refuses_memory_of_a_device(source, field):
    torch = Torch().library
    volume = tw.Volume(torch.as_tensor(source, device="cuda"), GRID)
    with pytest.raises(tw.InputError, match="device"):
        tw.deform(volume, field, outside="background", backend="cpu")


def test_a_picture_of_what_lies_on_the_device_has_the_bytes_of_the_cpu(source):
    torch = Torch().library
    volume = tw.Volume(source, GRID)
    there = tw.Volume(torch.as_tensor(source, device="cuda"), GRID)
    picture = tw.render(volume, size=(90, 70), angle=30, backend="cpu")
    assert tw.render(there, size=(90, 70), angle=30, backend="cuda").tobytes() == picture.tobytes()


def page(method):
    move = {"handle": {"at": {"body": [0.5, 0.5, 0.5]}, "radius_mm": 25}, "by_mm": [3, -12, 4]}
    return {
        "name": "push", "method": method, "cell_size": 6,
        "tissues": [{"name": "all", "compression": 0.2, "stretch": 0.2, "shear": 0.2, "youngs_modulus_kpa": 4}],
        "hold": [{"border": True}],
        "phases": [{"frames": 3, "move": [move]}],
    }


@pytest.fixture(scope="module", params=["chainmail", "mass-spring"])
def played(request):
    ct = tw.phantom((60, 52, 40), spacing=(4, 4, 5))
    fields = {
        backend: [frame.field for frame in tw.simulate(page(request.param), ct, backend=backend)] for backend in ("cpu", "cuda")
    }
    return ct, fields


def test_a_simulation_leaves_its_field_on_the_device(arrays, played):
    _, fields = played
    for mine, host in zip(fields["cuda"], fields["cpu"], strict=True):
        there = mine.displacement
        assert not isinstance(there, np.ndarray)
        assert there.shape == host.displacement.shape
        assert np.asarray(there).tobytes() == host.displacement.tobytes()
        taken = [arrays.taken(there) for _ in range(2)]
        assert arrays.pointer(taken[0]) == arrays.pointer(taken[1])
        assert arrays.on_host(taken[0]).tobytes() == host.displacement.tobytes()
    assert len({np.asarray(one.displacement).tobytes() for one in fields["cuda"]}) == 3, "frames share their memory"


def test_a_field_on_the_device_serves_every_backend_and_file(played, tmp_path):
    ct, fields = played
    mine, host = fields["cuda"][-1], fields["cpu"][-1]
    expected = tw.deform(ct, host, backend="cpu", outside="background")
    for backend in ("cpu", "cuda"):
        done = tw.deform(ct, mine, backend=backend, outside="background")
        assert done.volume.array.tobytes() == expected.volume.array.tobytes()
    for name, field in (("mine.mha", mine), ("host.mha", host)):
        tw.write_field(field, tmp_path / name)
    assert (tmp_path / "mine.mha").read_bytes() == (tmp_path / "host.mha").read_bytes()
    points = [(5.0, -3.0, 7.0), (0.0, 0.0, 0.0)]
    moved = [tw.move_points(points, field, ct.geometry)[0].tobytes() for field in (mine, host)]
    assert moved[0] == moved[1]


def test_numpy_gets_no_view_of_a_device(played):
    with pytest.raises(ValueError, match="device"):
        played[1]["cuda"][0].displacement.__array__(copy=False)
