# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""A program as users write it, for a checker of types; it is not run."""

import numpy as np
import tetwarp as tw
import tetwarp.hdf5
import tetwarp.zarr

ct: tw.Volume = tw.read("study")
grid: tw.Geometry = ct.geometry
size: tuple[int, int, int] = grid.size
field: tw.VertexField = tw.fields.elastic(grid, amplitude=8, spacing=40, seed=7, cell_size=4)
both: tw.VertexField = tw.compose(field, tw.fields.wave(grid, amplitude="2vox", wavelength=60))
labels = tw.Volume(np.zeros(grid.shape, np.uint8), grid)
done: tw.Deformed = tw.deform(
    ct, both, maps=("coverage", "jacobian"), with_=[tw.Along(labels, interpolation="vote")], points=[[0, 0, 0]]
)
inverted: int = done.report.inverted
jacobian: tw.Volume = done.maps["jacobian"]
inverse: tw.PullField = tw.invert(field, grid)
again: tw.Deformed = tw.deform(ct, pull_field=inverse, outside="background")
moved, inside = tw.move_points(np.zeros((4, 3)), field, grid)
warp = tw.Resampler(grid, backend="cpu", threads=2, memory="2G")
warp.set_field(field, outside="rest")
volumes, maps, report = warp.resample([ct, tw.Target(labels, "nearest")], maps=["folds"])
for frame in tw.simulate("scenario.json", ct):
    step: tw.VertexField = frame.field
with tw.view(ct, scenario={"name": "x"}, labels=labels, iframe=True) as shown:
    now: tw.VertexField = shown.field
    repeated = tw.simulate(shown.scenario or {}, ct)
    where: str = shown.url
picture = tw.render(done.volume, transfer="ct-bone", angle=30)
tw.write(done.volume, "out.nii.gz", compress=1)
tw.write_field(field, "field.mha")
status: int = tw.batch("manifest.csv", "out", resume=True)
stored: tw.Volume = tetwarp.zarr.read("ct.ome.zarr", level=1, index={"t": 0}, space="LPS", unit="micrometer")
tetwarp.zarr.write(stored, "out.ome.zarr", chunks=(32, 128, 128), levels=3, version="0.4", overwrite=True)
streamed: tw.Report = tetwarp.zarr.deform("ct.ome.zarr", "out.ome.zarr", field, space="LPS", outside="background")
plain: tw.Volume = tetwarp.hdf5.read("case.h5", dataset="image", geometry=grid, order="ijk")
