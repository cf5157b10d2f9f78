# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""DICOM segmentations of highdicom, and what those of label_segmentations.py are made and judged by."""

import numpy as np
import pydicom

from world import FIELD, expect, moved, need, voxels_that_differ

NAMES = ("ball", "ring", "box", "plate")
SHIFT = ("translate:by=5/-2.5/3",)  # two voxels, one back, one up: the answer needs no deformation


def masks_of(world):
    """Four masks [segment, k, j, i]; the first three overlap."""
    centre = world.points.reshape(-1, 3).mean(0)
    return np.array(
        [
            world.ball(centre, 26),
            world.tube(centre, 40) & ~world.tube(centre, 20),
            world.box(centre + (20, -10, 4), (22, 17, 13)),
            world.box(centre - (30, 25, 0), (6, 25, 2)),
        ]
    ).astype(np.uint8)


def fractions_of(world):
    """Two volumes of 0 to 255."""
    masks = masks_of(world)
    ramp = (world.points[..., 0] - world.points[..., 0].min()) * 1.2
    return np.array([masks[0] * 200, masks[1] * ramp]).astype(np.uint8)


def compared(found, found_affine, expected, affine):
    """@param found, expected  volumes of segments. @param found_affine  of all, or a list of them"""
    expect(len(found) == len(expected), f"{len(found)} segments, expected {len(expected)}")
    affines = found_affine if isinstance(found_affine, list) else [found_affine] * len(found)
    wrong = [voxels_that_differ(a, place, b, affine) for a, place, b in zip(found, affines, expected, strict=True)]
    voxels = [int((b != 0).sum()) for b in expected]
    expect(not any(wrong), f"voxels that differ, segment by segment: {wrong} of {voxels}")
    return f"all {sum(voxels)} voxels equal"


def expected_of(world, volumes, how, **named):
    results = [world.deform_mask(volume, how, **named) for volume in volumes]
    return [values for values, _ in results], results[0][1]


class Highdicom:
    def __init__(self):
        self.hd, self.version = need("highdicom")

    def descriptions(self, count):
        hd, codes = self.hd, pydicom.sr.codedict.codes
        algorithm = hd.AlgorithmIdentificationSequence("Net", codes.DCM.ArtificialIntelligence, "1.0")
        return [
            hd.seg.SegmentDescription(
                n + 1,
                f"{NAMES[n % 4]} ü {n}",
                codes.SCT.Organ,
                codes.SCT.Liver,
                "AUTOMATIC",
                algorithm,
                tracking_uid=pydicom.uid.generate_uid(),
                tracking_id=f"finding {n}",
                anatomic_regions=[codes.SCT.Abdomen],
            )
            for n in range(count)
        ]

    def make(self, world, array, kind, count, **named):
        uid = pydicom.uid.generate_uid
        made = self.hd.seg.Segmentation(
            world.slices,
            array,
            kind,
            self.descriptions(count),
            uid(),
            7,
            uid(),
            1,
            "Maker",
            "Model",
            "1",
            "SN",
            content_creator_name="Doe^John",
            content_label="ORGANS",
            **named,
        )
        made.SpecificCharacterSet = "ISO_IR 192"  # the CT has none; labels have an umlaut
        return made

    def volume(self, world, volumes, affine):
        """Segments on any grid, [k, j, i]."""
        to_array = affine[:, [2, 1, 0, 3]]
        return self.hd.Volume(
            np.moveaxis(volumes, 0, -1),
            to_array,
            "PATIENT",
            world.slices[0].FrameOfReferenceUID,
            channels={"SegmentNumber": list(range(1, len(volumes) + 1))},
        )

    def check(self, world, path, volumes, how, on_slices=True, field=FIELD, expected=None, **named):
        out, slices = world.moved_object(path, ":own" if named.get("own") else "", field=field)
        found, source = self.hd.seg.segread(out), self.hd.seg.segread(path)
        described = [segment for segment in source.SegmentSequence if segment.SegmentNumber != 0]  # no background
        expect(list(found.SegmentSequence) == described, "Segment Sequence")
        for keyword in (
            "SpecificCharacterSet",
            "SegmentationType",
            "SegmentationFractionalType",
            "MaximumFractionalValue",
            "ContentLabel",
            "ContentCreatorName",
        ):
            wanted = "BINARY" if source.get(keyword) == "LABELMAP" else source.get(keyword)
            expect(found.get(keyword) == wanted, keyword)
        expect(found.get_tracking_ids() == source.get_tracking_ids(), "tracking IDs")
        derived = [s.SOPInstanceUID for s in slices]
        named_series = {(study, series) for study, series, _ in found.get_source_image_uids()}
        expect(named_series == {(slices[0].StudyInstanceUID, slices[0].SeriesInstanceUID)}, "referenced series")
        expect(sorted(uid for _, _, uid in found.get_source_image_uids()) == sorted(derived), "referenced slices")
        wanted, affine = expected or expected_of(world, volumes, how, field=field, **named)
        volume = found.get_volume(rescale_fractional=False, skip_overlap_checks=True)
        back = volume.affine[:, [2, 1, 0, 3]]
        result = compared(np.moveaxis(volume.array, -1, 0), back, wanted, affine)
        if on_slices:
            pixels = found.get_pixels_by_source_instance(
                derived, assert_missing_frames_are_empty=True, rescale_fractional=False, skip_overlap_checks=True
            )
            expect(np.array_equal(np.moveaxis(pixels, -1, 0), np.array(wanted)), "pixels by source instance")
        return result

    def save(self, world, segmentation):
        path = world.folder / "highdicom.dcm"
        segmentation.save_as(path)
        return path

    def on_slices(self, world, volumes, kind="BINARY", edit=lambda made: made, field=FIELD, expected=None, **named):
        array = np.moveaxis(volumes, 0, -1)
        if kind == "FRACTIONAL":
            array = array / np.float64(255)
        elif kind == "LABELMAP":
            array = (array * np.arange(1, len(volumes) + 1)).max(-1).astype(named.pop("type", np.uint8))
        path = self.save(world, edit(self.make(world, array, kind, len(volumes), **named)))
        return self.check(
            world, path, volumes, "linear" if kind == "FRACTIONAL" else "vote", field=field, expected=expected
        )

    def on_grid(self, world, affine, shape, own=False, omit=True):
        """The masks on another grid, by the nearest voxel."""
        k, j, i = np.indices(shape)
        at = np.rint(moved(np.linalg.inv(world.affine) @ affine, np.stack([i, j, k], -1))).astype(int)[..., ::-1]
        inside = ((at >= 0) & (at < world.shape)).all(-1)
        at = np.where(inside[..., None], at, 0)
        volumes = masks_of(world)[:, at[..., 0], at[..., 1], at[..., 2]] * inside
        volumes = volumes.astype(np.uint8)
        if own:  # beyond the outermost frames a segmentation is empty, while a volume goes on for half a voxel
            volumes[:, [0, -1]] = 0
        path = self.save(
            world, self.make(world, self.volume(world, volumes, affine), "BINARY", len(volumes), omit_empty_frames=omit)
        )
        return self.check(world, path, volumes, "vote", on_slices=False, affine=affine, own=own)


def shuffled(segmentation):
    """The same frames in another order."""
    count, pixels = int(segmentation.NumberOfFrames), segmentation.Rows * segmentation.Columns
    bits = np.unpackbits(np.frombuffer(segmentation.PixelData, np.uint8), bitorder="little")[: count * pixels].reshape(
        count, pixels
    )
    order = np.random.default_rng(1).permutation(count)
    segmentation.PerFrameFunctionalGroupsSequence = [segmentation.PerFrameFunctionalGroupsSequence[n] for n in order]
    packed = np.packbits(bits[order].ravel(), bitorder="little").tobytes()
    segmentation.PixelData = packed + b"\0" * (len(packed) % 2)
    return segmentation


def every_third(masks):
    masks = masks.copy()
    masks[:, np.arange(masks.shape[1]) % 3 != 0] = 0
    return masks


def turned(world, axes):
    """The grid of the CT with its axes in another order, `axes` of [i, j, k]."""
    affine = world.affine[:, [*axes, 3]]
    size = np.array(world.shape[::-1])[list(axes)]
    if np.linalg.det(affine[:3, :3]) < 0:  # frames of a segmentation are right-handed: the last axis runs the other way
        affine = affine.copy()
        affine[:3, 3] += affine[:3, 2] * (size[2] - 1)
        affine[:3, 2] *= -1
    return affine, tuple(size[::-1])


def oblique(world):
    a, b = np.radians((20, 15))
    turn = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]]) @ np.array(
        [[np.cos(b), -np.sin(b), 0], [np.sin(b), np.cos(b), 0], [0, 0, 1]]
    )
    shape, affine = (35, 49, 75), np.eye(4)
    affine[:3, :3] = turn * (1.7, 2.1, 2.5)
    affine[:3, 3] = world.points.reshape(-1, 3).mean(0) - affine[:3, :3] @ ((np.array(shape[::-1]) - 1) / 2)
    return affine, shape


def coarse(world):
    affine = world.affine.copy()
    affine[:3, 3] += affine[:3, :3] @ (0.5, 0.5, 0.5)
    affine[:3, :3] *= 2
    return affine, tuple(n // 2 for n in world.shape)


def by_shift(world):
    """The masks moved by whole voxels, with NumPy."""
    padded = np.pad(masks_of(world), ((0, 0), (1, 1), (1, 1), (2, 2)))
    k, j, i = world.shape
    return list(padded[:, :k, 2 : 2 + j, :i]), world.affine


def highdicom_cases():
    def case(run_it):
        return lambda world: run_it(Highdicom(), world)

    def apart(world):
        """Three masks without overlaps."""
        masks = masks_of(world)
        return np.array([masks[0], masks[3] & ~masks[0], masks[2] & ~masks[0] & ~masks[3]]).astype(np.uint8)

    def many(world, count):
        """Boxes of 4 x 4 x 2 voxels, none of which touches another."""
        volumes = np.zeros((count, *world.shape), np.uint8)
        for n, volume in enumerate(volumes):
            i, j, k = 3 + n % 10 * 6, 3 + n // 10 % 6 * 6, 2 + n // 60 * 4
            volume[k : k + 2, j : j + 4, i : i + 4] = 1
        return volumes

    syntax = pydicom.uid
    proof = "read by highdicom: voxels, segments, references"
    yield "SEG BINARY, 4 segments that overlap", proof, case(lambda h, w: h.on_slices(w, masks_of(w)))
    yield "the same, by NumPy alone (a shift)", proof, case(
        lambda h, w: h.on_slices(w, masks_of(w), field=SHIFT, expected=by_shift(w))
    )
    yield "SEG BINARY, empty frames kept", proof, case(
        lambda h, w: h.on_slices(w, masks_of(w), omit_empty_frames=False)
    )
    yield "SEG BINARY, frames in another order", proof, case(lambda h, w: h.on_slices(w, masks_of(w), edit=shuffled))
    yield "SEG BINARY, every third slice", proof, case(lambda h, w: h.on_slices(w, every_third(masks_of(w))))
    yield "SEG BINARY, 117 segments", proof, case(
        lambda h, w: h.on_slices(
            w,
            np.array([w.ball((n % 11 * 8 - 40, n // 11 * 6 - 30, n % 7 * 6 - 18), 7) for n in range(117)]).astype(
                np.uint8
            ),
        )
    )
    yield "SEG BINARY, Implicit Little Endian", proof, case(
        lambda h, w: h.on_slices(w, masks_of(w), transfer_syntax_uid=syntax.ImplicitVRLittleEndian)
    )
    yield "SEG FRACTIONAL, probability, to 255", proof, case(lambda h, w: h.on_slices(w, fractions_of(w), "FRACTIONAL"))
    yield "SEG FRACTIONAL, occupancy, frames kept", proof, case(
        lambda h, w: h.on_slices(w, fractions_of(w), "FRACTIONAL", fractional_type="OCCUPANCY", omit_empty_frames=False)
    )
    for name, grid in (
        ("coronal", lambda w: turned(w, (0, 2, 1))),
        ("sagittal", lambda w: turned(w, (1, 2, 0))),
        ("oblique", oblique),
        ("half the resolution", coarse),
    ):
        yield f"SEG BINARY, {name}", proof, case(lambda h, w, grid=grid: h.on_grid(w, *grid(w)))
        if name != "oblique":  # it reaches beyond the CT, where `own` needs --outside
            yield f"SEG BINARY, {name}, `own`, frames kept", proof, case(
                lambda h, w, grid=grid: h.on_grid(w, *grid(w), own=True, omit=False)
            )
            yield f"SEG BINARY, {name}, `own`", proof, case(lambda h, w, grid=grid: h.on_grid(w, *grid(w), own=True))
    for name, coding in (("RLE", syntax.RLELossless), ("JPEG-LS", syntax.JPEGLSLossless), ("JPEG 2000", syntax.JPEG2000Lossless)):
        yield f"SEG FRACTIONAL, {name}", proof, case(
            lambda h, w, coding=coding: h.on_slices(w, fractions_of(w), "FRACTIONAL", transfer_syntax_uid=coding)
        )
        yield f"SEG LABELMAP, {name}", proof, case(
            lambda h, w, coding=coding: h.on_slices(w, apart(w), "LABELMAP", transfer_syntax_uid=coding)
        )
    yield "SEG LABELMAP, 3 segments", proof, case(lambda h, w: h.on_slices(w, apart(w), "LABELMAP"))
    yield "SEG LABELMAP, empty frames kept", proof, case(
        lambda h, w: h.on_slices(w, apart(w), "LABELMAP", omit_empty_frames=False)
    )
    yield "SEG LABELMAP, 300 segments", proof, case(
        lambda h, w: h.on_slices(w, many(w, 300), "LABELMAP", type=np.uint16)
    )


def cases():
    """Tuples: program; how its version is found; its cases, which are (object, proof, check)."""
    yield "highdicom", lambda: Highdicom().version, highdicom_cases
