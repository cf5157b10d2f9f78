# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Reads de-identified output as somebody would who wants to know whom it shows.

hostile_search.py SOURCE OPTIONS OUTPUT...: every string of patient, study, institution, device and private data of the
DICOM files of the folder SOURCE is looked for in all files OUTPUT (folders are entered): as bytes, and as values of
attributes. OPTIONS are those of --deidentify. The groups are said here anew, not taken from the program's table.
"""
import pathlib
import re
import sys

import pydicom

DATES = {"DA", "DT", "TM"}
DEVICE = {0x00081010, 0x00181000, 0x00181002, 0x00181003, 0x00181200, 0x00181201}
INSTITUTION = {0x00080080, 0x00080081, 0x00081040, 0x00081041, 0x00080082}
PATIENT = {0x00100040, 0x00101010, 0x00101020, 0x00101030, 0x00102160, 0x001021A0, 0x001021C0}
TEXTS_OF_0008 = {0x00080050, 0x00080090, 0x00080092, 0x00080094, 0x00081030, 0x0008103E, 0x00081048, 0x00081050,
                 0x00081060, 0x00081070, 0x00081080, 0x00082111, 0x00084000}
OTHERS = {0x00200010, 0x00204000, 0x00181030, 0x00184000, 0x00180010, 0x00181400}
NUMBERS = {0x7FE00010, 0x00640009}  # of pixels and of the grid of a registration, which hold any bytes
OPEN = {0x00120062, 0x00120063, 0x00120064,  # how it was de-identified
        0x00120052, 0x00120053}  # time since an event, which stands for dates in studies


def is_secret(element, options):
    tag = int(element.tag)
    group = tag >> 16
    if tag in OPEN:
        return False
    if tag in PATIENT:
        return "retain-patient" not in options
    if element.VR in DATES:
        return not options & {"retain-dates", "shift-dates"} or tag == 0x00100030
    if element.VR == "UI":
        return "retain-uids" not in options
    if tag in DEVICE:
        return "retain-device" not in options
    if tag in INSTITUTION:
        return "retain-institution" not in options
    return (group % 2 == 1 or group in (0x0010, 0x0012, 0x0032, 0x0038, 0x0040) or element.VR == "PN"
            or tag in TEXTS_OF_0008 | OTHERS)


def texts(element):
    value = element.value
    values = value if isinstance(value, pydicom.multival.MultiValue) else [value]
    for one in values:
        if isinstance(one, bytes):
            yield from (found.decode() for found in re.findall(rb"[ -~]{5,}", one))
        elif one is not None and not isinstance(one, (int, float)):
            yield str(one).strip()
            if element.VR == "PN":
                yield from str(one).replace("^", " ").replace("=", " ").split()


def walk(dataset, inside=False):
    for element in dataset:
        if element.VR == "SQ":
            for item in element.value:
                yield from walk(item, inside or element.tag.is_private)
        elif element.tag not in NUMBERS:
            yield element, inside


def strings(folder, *groups):
    """The strings of each group, which is a question to an element. What is inside a private sequence is of all groups."""
    found = [set() for _ in groups]
    for path in files([folder]):
        try:
            dataset = pydicom.dcmread(path, stop_before_pixels=True)
        except pydicom.errors.InvalidDicomError:
            continue
        for element, in_private in walk(dataset):
            of_element = {text for text in texts(element) if len(text) > 3}
            for of_group, wanted in zip(found, groups):
                if in_private or wanted(element):
                    of_group |= of_element
    return found


def files(paths):
    for path in map(pathlib.Path, paths):
        yield from (p for p in (path.rglob("*") if path.is_dir() else [path]) if p.is_file())


def main():
    source, options, outputs = sys.argv[1], set(sys.argv[2].split(",")), sys.argv[3:]
    secrets, open_texts = strings(source, lambda e: is_secret(e, options), lambda e: not is_secret(e, options))
    secrets = {s for s in secrets - open_texts if not s.startswith("1.2.840.10008.") and s not in ("REMOVED", "NONE")}
    values = set()
    for output in outputs:
        values |= strings(output, lambda e: True)[0]
    found = sorted(secrets & values)
    letters = [s for s in secrets if len(s) > 4 and re.search("[A-Za-z]", s)] + \
              [s for s in secrets if re.fullmatch(r"[0-9.]{12,}", s)]
    for path in files(outputs):
        content = path.read_bytes()
        at = max(content.find(b"\xe0\x7f\x10\x00OW"), content.find(b"\x64\x00\x09\x00OF"))  # numbers hold any bytes
        head = (content[:at] if at >= 0 else content).decode("latin-1")
        found += [f"{path.name}: {s}" for s in letters if s in head]
    for one in found:
        print("found", one)
    print(f"searched for {len(secrets)} strings")
    return 1 if found or len(secrets) < 10 else 0


sys.exit(main())
