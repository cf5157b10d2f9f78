# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Sends derived series to an archive and fetches them back: storescu and getscu of DCMTK, Orthanc on loopback.

    check_archive.py TETWARP SERIES

SERIES, a folder of one CT series, is sent, and what `tetwarp deform` makes of it in each transfer syntax. Prints a line for
each claim. Exit status 0: all hold, 1: one does not, 77: a program is missing, or TETWARP_CI_FULL is not 1.
"""

import array
import contextlib
import ctypes
import io
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
import zlib

# How storescu is told to propose the syntax of --transfer-syntax.
SYNTAXES = {
    "explicit": ("-xe", "1.2.840.10008.1.2.1"),
    "deflated": ("-xd", "1.2.840.10008.1.2.1.99"),
    "rle": ("-xr", "1.2.840.10008.1.2.5"),
    "jpeg-ls": ("-xt", "1.2.840.10008.1.2.4.80"),
}
DEFLATED = SYNTAXES["deflated"][1]
# Of a file's meta header, what belongs to whoever wrote the file: its length, and the implementation's UID and name.
OF_THE_WRITER = {0x00020000, 0x00020012, 0x00020013}


def skip(reason):
    print(reason)
    sys.exit(77)


try:
    import pydicom
except ImportError:
    skip("python3-pydicom is not installed")


def require(holds, claim):
    print(("holds: " if holds else "FAILS: ") + claim, flush=True)
    if not holds:
        sys.exit(1)


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


class Archive:
    """Orthanc, on loopback alone as far as it can: HTTP refuses other hosts, and so does DICOM."""

    def __init__(self, folder):
        self.http, self.dicom, self.log = free_port(), free_port(), folder / "orthanc.log"
        (folder / "storage").mkdir()
        settings = {
            "StorageDirectory": str(folder / "storage"),
            "IndexDirectory": str(folder / "storage"),
            "Plugins": [],
            "HttpPort": self.http,
            "DicomPort": self.dicom,
            "DicomAet": "ARCHIVE",
            "RemoteAccessAllowed": False,
            "DicomAlwaysAllowEcho": False,
            "DicomAlwaysAllowStore": False,
            "DicomCheckModalityHost": True,
            "DicomModalities": {"test": ["TEST", "127.0.0.1", free_port()]},
            "TranscodeDicomProtocol": False,  # what was sent is what it hands out
            "StorageCompression": False,
        }
        self.settings = folder / "orthanc.json"
        self.settings.write_text(json.dumps(settings))

    def __enter__(self):
        end_with_this = lambda: ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG: also if this is killed
        with open(self.log, "w") as log:
            self.process = subprocess.Popen(["Orthanc", self.settings], stdout=log, stderr=log, preexec_fn=end_with_this)
        for _ in range(300):
            with contextlib.suppress(OSError):
                self.version = self.json("/system")["Version"]
                return self
            if self.process.poll() is not None:
                break
            time.sleep(0.2)
        self.__exit__()
        sys.exit("Orthanc does not start:\n" + self.log.read_text())

    def __exit__(self, *_):
        self.process.terminate()
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def get(self, path, data=None, **headers):
        request = urllib.request.Request(f"http://127.0.0.1:{self.http}{path}", data=data, headers=headers)
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.read()

    def json(self, path, data=None):
        return json.loads(self.get(path, data))

    def find(self, uid):
        """The identifiers of Orthanc of what has this UID."""
        return [one["ID"] for one in self.json("/tools/lookup", uid.encode())]

    def counts(self):
        counts = self.json("/statistics")
        return tuple(counts["Count" + what] for what in ("Patients", "Studies", "Series", "Instances"))

    def peer(self):
        return ["-aet", "TEST", "-aec", "ARCHIVE", "127.0.0.1", str(self.dicom)]

    def store(self, files, propose):
        """How many files got the status Success (0000)."""
        command = ["storescu", "-v", "-R", propose, *self.peer(), *map(str, files)]
        run = subprocess.run(command, capture_output=True, text=True, errors="replace")
        return run.stdout.count("Received Store Response (Success)") + run.stderr.count("Received Store Response (Success)")


class Instance:
    """A DICOM file in its parts."""

    def __init__(self, content):
        end = 144 + int.from_bytes(content[140:144], "little")
        self.content, self.stored = content, content[end:]
        header = pydicom.dcmread(io.BytesIO(content), stop_before_pixels=True)
        self.meta = {int(e.tag): e.value for e in header.file_meta if int(e.tag) not in OF_THE_WRITER}
        self.syntax = header.file_meta.TransferSyntaxUID
        self.data = zlib.decompress(self.stored, -zlib.MAX_WBITS) if self.syntax == DEFLATED else self.stored
        self.uid, self.series, self.study = header.SOPInstanceUID, header.SeriesInstanceUID, header.StudyInstanceUID


def instances_in(folder):
    return [Instance(path.read_bytes()) for path in sorted(folder.iterdir())]


def deform(tetwarp, source, output, syntax):
    field = ["-f", "wave:amplitude=8,wavelength=96", "--cell-size", "8"]
    command = [tetwarp, "deform", source, *field, "--transfer-syntax", syntax, "-o", output, "--quiet"]
    subprocess.run(command, check=True)
    return instances_in(output)


def check_fetched(archive, name, sent):
    """Fetches the files by REST, one after the other, and compares them with what was sent."""
    back = [Instance(archive.get(f"/instances/{archive.find(one.uid)[0]}/file")) for one in sent]
    pairs = list(zip(sent, back))
    require(all(a.data == b.data for a, b in pairs), f"{name}: all {len(sent)} data sets come back byte for byte")
    require(all(a.meta == b.meta for a, b in pairs), f"{name}: meta headers differ in nothing but who wrote the file")
    if not all(a.stored == b.stored for a, b in pairs):
        require(name == "deflated", f"{name}: deflated anew, the same when inflated")


def check_indexed(archive, name, sent, study):
    found = archive.find(sent[0].series)
    require(len(found) == 1, f"{name}: one series has its UID")
    series = archive.json(f"/series/{found[0]}")
    require(len(series["Instances"]) == len(sent), f"{name}: it has {len(sent)} instances")
    require(archive.find(study) == [series["ParentStudy"]], f"{name}: it is in the study of the source")


def decoded(archive, sent):
    """The pixels as the archive decodes them: 16 bits, little endian, slice by slice."""
    accept = {"Accept": "image/x-portable-arbitrarymap"}
    for one in sent:
        image = archive.get(f"/instances/{archive.find(one.uid)[0]}/frames/0/image-int16", **accept)
        values = array.array("h", image.split(b"ENDHDR\n", 1)[1])
        values.byteswap()  # big endian in a PAM file
        yield values.tobytes()


def stored_values(instances):
    return [pydicom.dcmread(io.BytesIO(one.content)).PixelData for one in instances]


def check_stored_again(archive, tetwarp, source, folder, series):
    before = archive.counts()
    for name, sent in series.items():
        again = deform(tetwarp, source, folder / f"{name}-again", name)
        stored = archive.store(sorted((folder / f"{name}-again").iterdir()), SYNTAXES[name][0])
        require(stored == len(sent), f"{name}: made and sent again, each is accepted")
        states = {archive.json("/instances", one.content)["Status"] for one in again}
        require(states == {"AlreadyStored"}, f"{name}: by REST, each is there already")
    require(archive.counts() == before, f"nothing was added: {before} patients, studies, series, instances")


def check_query(archive, folder, sent):
    """Fetches the files by C-GET, which getscu accepts only without compression."""
    (folder / "got").mkdir()
    keys = [("0008,0052", "SERIES"), ("0020,000d", sent[0].study), ("0020,000e", sent[0].series)]
    keys = [word for key, value in keys for word in ("-k", f"{key}={value}")]
    subprocess.run(["getscu", "-S", "+B", "-od", folder / "got", *keys, *archive.peer()], check=True)
    back = {one.uid: one for one in instances_in(folder / "got")}
    same = len(back) == len(sent) and all(back[one.uid].data == one.data for one in sent)
    require(same, "explicit: by C-GET too, all data sets come back byte for byte")


def check(archive, tetwarp, source, folder):
    print(f"Orthanc {archive.version}; {subprocess.check_output(['storescu', '--version'], text=True).splitlines()[0]}")
    originals = instances_in(source)
    require(archive.store(sorted(source.iterdir()), "-xe") == len(originals), "the source is stored")
    derived = {}
    for name, (propose, uid) in SYNTAXES.items():
        derived[name] = sent = deform(tetwarp, source, folder / name, name)
        require({one.syntax for one in sent} == {uid}, f"{name}: is {uid}")
        require(archive.store(sorted((folder / name).iterdir()), propose) == len(sent), f"{name}: each is stored")
        check_fetched(archive, name, sent)
        check_indexed(archive, name, sent, originals[0].study)
    files = (1 + len(derived)) * len(originals)
    require(archive.counts() == (1, 1, 1 + len(derived), files), "one patient, one study, a series for each")
    truth = stored_values(derived["explicit"])
    for name, sent in derived.items():
        require(list(decoded(archive, sent)) == truth, f"{name}: decoded by the archive, all voxels are those of explicit")
    check_query(archive, folder, derived["explicit"])
    check_stored_again(archive, tetwarp, source, folder, derived)


def main():
    tetwarp, source = sys.argv[1:]
    if os.environ.get("TETWARP_CI_FULL") != "1":
        skip("only with TETWARP_CI_FULL=1")
    os.environ["PATH"] += ":/usr/sbin"  # where Debian has Orthanc; of root's PATH only
    for program in ("Orthanc", "storescu", "getscu"):
        if not shutil.which(program):
            skip(f"{program} is not installed (Debian: orthanc, dcmtk)")
    source = pathlib.Path(source)
    if not source.is_dir():
        skip(f"no real data: {source} is not there")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    with tempfile.TemporaryDirectory(prefix="tetwarp-archive-") as scratch, Archive(pathlib.Path(scratch)) as archive:
        check(archive, tetwarp, source, pathlib.Path(scratch))


main()
