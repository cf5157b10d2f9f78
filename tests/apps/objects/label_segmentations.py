# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""DICOM segmentations made of label images: by dcmqi, with which 3D Slicer writes them, and by pydicom-seg."""

import json
import pathlib
import sys

import nibabel
import numpy as np
import pydicom

from segmentations import compared, expected_of, masks_of
from world import TO_RAS, expect, moved, need, run, tool

# --- dcmqi


def metainformation(segments):
    """What dcmqi wants to know. @param segments  of each file: (label, name)"""

    def code(value, meaning):
        return {"CodeValue": value, "CodingSchemeDesignator": "SCT", "CodeMeaning": meaning}

    return {
        "ContentCreatorName": "Doe^Jane",
        "ContentLabel": "SEGMENTATION",
        "ContentDescription": "by hand",
        "SeriesDescription": "organs",
        "SeriesNumber": "300",
        "InstanceNumber": "1",
        "BodyPartExamined": "",
        "segmentAttributes": [
            [
                {
                    "labelID": label,
                    "SegmentLabel": name,
                    "SegmentDescription": f"the {name}",
                    "SegmentAlgorithmType": "SEMIAUTOMATIC",
                    "SegmentAlgorithmName": "Paint",
                    "recommendedDisplayRGBValue": [177, 122, 101],
                    "TrackingIdentifier": f"the {name}",
                    "TrackingUniqueIdentifier": pydicom.uid.generate_uid(),
                    "SegmentedPropertyCategoryCodeSequence": code("123037004", "Anatomical Structure"),
                    "SegmentedPropertyTypeCodeSequence": code("10200004", "Liver"),
                }
                for label, name in one
            ]
            for one in segments
        ],
    }


def save_nifti(world, values, path):
    nibabel.save(nibabel.Nifti1Image(values.transpose(2, 1, 0), TO_RAS @ world.affine), path)


def labels_in_file(world):
    """Writes a.nii, whose labels 1 to 3 do not overlap. @return the mask of each"""
    masks = masks_of(world)
    labels = np.where(masks[0], 1, np.where(masks[3], 2, np.where(masks[2], 3, 0))).astype(np.uint8)
    save_nifti(world, labels, world.folder / "a.nii")
    return [labels == n for n in (1, 2, 3)]


def dcmqi_tool(name):
    beside = pathlib.Path(sys.executable).parent / name  # of the virtual environment
    return str(beside) if beside.exists() else tool(name)


def made_by_dcmqi(world, *options, overlap=True):
    """Label images, as 3D Slicer has them: three segments that do not overlap, and in a second image one that does."""
    folder, ring = world.folder, masks_of(world)[1]
    volumes, images = labels_in_file(world), [f"{folder}/a.nii"]
    segments = [[(1, "ball"), (2, "plate"), (3, "box")]]
    if overlap:
        volumes.append(ring > 0)
        images.append(f"{folder}/b.nii")
        segments.append([(1, "ring")])
        save_nifti(world, ring, folder / "b.nii")
    (folder / "meta.json").write_text(json.dumps(metainformation(segments)))
    path = folder / "dcmqi.dcm"
    run(
        dcmqi_tool("itkimage2segimage"),
        "--inputImageList",
        ",".join(images),
        "--inputDICOMDirectory",
        world.ct,
        "--outputDICOM",
        path,
        "--inputMetadata",
        folder / "meta.json",
        *options,
    )
    return path, np.array(volumes)


def check_dcmqi(world, *options, **named):
    path, volumes = made_by_dcmqi(world, *options, **named)
    out, _ = world.moved_object(path)
    back = world.folder / "back"
    back.mkdir(exist_ok=True)
    for old in back.iterdir():
        old.unlink()
    run(
        dcmqi_tool("segimage2itkimage"),
        "--inputDICOM",
        out,
        "--outputDirectory",
        back,
        "--outputType",
        "nii",
        "--prefix",
        "s",
    )
    images = [
        nibabel.load(one)
        for one in sorted(back.glob("s-*.nii*"), key=lambda p: int(p.name.split("-")[1].split(".")[0]))
    ]
    told = json.loads((back / "s-meta.json").read_text())["segmentAttributes"]
    given = json.loads((world.folder / "meta.json").read_text())["segmentAttributes"]

    def attributes(lists):
        return [
            [
                one[key]
                for key in (
                    "SegmentLabel",
                    "SegmentDescription",
                    "SegmentAlgorithmType",
                    "SegmentAlgorithmName",
                    "TrackingIdentifier",
                    "TrackingUniqueIdentifier",
                )
            ]
            for some in lists
            for one in some
        ]

    expect(attributes(told) == attributes(given), f"attributes of segments: {attributes(told)}")
    wanted, affine = expected_of(world, volumes, "vote")
    found = [(np.asarray(image.dataobj).transpose(2, 1, 0) != 0).astype(np.uint8) for image in images]
    return compared(found, [TO_RAS @ image.affine for image in images], wanted, affine)


def dcmqi_cases():
    proof = "read by dcmqi: voxels, segments"
    yield "SEG BINARY, segments of two images", proof, check_dcmqi
    yield "SEG BINARY, empty frames kept", proof, lambda world: check_dcmqi(world, "--skip", "0")
    yield "SEG BINARY, deflated", proof, lambda world: check_dcmqi(world, "--compress", "deflate")
    for name, more in (("", ()), (", labels as Segment Numbers", ("--useLabelIDAsSegmentNumber",))):
        yield f"SEG LABELMAP{name}", proof, lambda world, more=more: check_dcmqi(
            world, "--segmentationType", "labelmap", *more, overlap=False
        )


def dcmqi_version():
    return run(dcmqi_tool("itkimage2segimage"), "--version").split("tag: v")[-1].split()[0]


# --- pydicom-seg


def refused(world, path, words):
    done, _ = world.deform_with(path)
    message = done.stderr.strip().replace(str(path), "FILE")
    expect(
        done.returncode == 4 and message.startswith("tetwarp: error: ") and "\n" not in message,
        f"status {done.returncode}: {message}",
    )
    expect(all(word in message for word in words), f"says: {message}")
    return "refused in one line"


def check_pydicom_seg(module, world, own_frame, **options):
    """@param own_frame  as the package writes it: in a frame of reference that it makes up"""
    import SimpleITK

    volumes = labels_in_file(world)
    template = module.template.from_dcmqi_metainfo(metainformation([[(1, "ball"), (2, "plate"), (3, "box")]]))
    frame = str(world.slices[0].FrameOfReferenceUID)
    named = {"inplane_cropping": False, "skip_empty_slices": True, "skip_missing_segment": False, **options}
    made = module.MultiClassWriter(template=template, **named).write(
        SimpleITK.ReadImage(str(world.folder / "a.nii")), [pydicom.dcmread(path) for path in sorted(world.ct.iterdir())]
    )
    path = world.folder / "pydicom_seg.dcm"
    if not own_frame:
        made.FrameOfReferenceUID = frame
    made.save_as(path)
    if own_frame:
        return refused(world, path, ("FILE", "Frame of Reference"))
    out, _ = world.moved_object(path)
    read = module.SegmentReader().read(pydicom.dcmread(out))
    wanted, affine = expected_of(world, volumes, "vote")
    found = [read.segment_data(n) for n in sorted(read.available_segments)]
    back = np.eye(4)
    back[:3, :3] = np.reshape(read.direction, (3, 3)) * read.spacing
    back[:3, 3] = read.origin
    return compared(found, back, wanted, affine)


def pydicom_seg_cases(module):
    proof = "read by it: voxels"
    yield "SEG as it is written", "the message: it makes up a frame of reference", lambda w: check_pydicom_seg(
        module, w, True
    )
    yield "SEG, frame of reference put right", proof, lambda w: check_pydicom_seg(module, w, False)
    yield "SEG, empty frames kept", proof, lambda w: check_pydicom_seg(module, w, False, skip_empty_slices=False)
    yield "SEG, frames cropped to what they show", proof, lambda w: check_pydicom_seg(
        module, w, False, inplane_cropping=True
    )


def cases():
    """As those of segmentations.py."""
    yield "dcmqi", dcmqi_version, dcmqi_cases
    for package in ("pydicom-seg", "pydicom-seg-rb"):
        name = package.replace("-", "_")
        yield (
            package,
            lambda package=package, name=name: need(package, name)[1],
            lambda package=package, name=name: pydicom_seg_cases(need(package, name)[0]),
        )
