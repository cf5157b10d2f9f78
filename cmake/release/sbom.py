#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Writes the bill of materials of a release to standard output: SPDX 2.3 as JSON.

    cmake/release/sbom.py SOURCE FOLDER
    cmake/release/sbom.py --check PACKAGE...    whether the licences of packages of Debian are known; nothing is written

SOURCE: a folder in which cmake/debian/build.sh and python/wheels.sh were run. FOLDER: with the files of the release.
Nothing is listed by hand but licences: what is compiled with is every file outside of SOURCE that the compiler read (the
log of ninja, of the packages and of each wheel) and the package of Debian that it belongs to, STATIC_LINK where that has
headers alone, so that its code is in what was compiled; what is loaded is what the packages depend on and what auditwheel
put into the wheels. A package whose licence is not known here is an error, so that none is forgotten.
"""
import datetime
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import uuid
import zipfile

# Licences of Debian's source packages, as /usr/share/doc/PACKAGE/copyright states them for what is used of them.
LICENCES = {
    "boost": "BSL-1.0", "boost-defaults": "BSL-1.0", "cli11": "BSD-3-Clause", "dcmtk": "BSD-3-Clause AND IJG",
    "eigen3": "MPL-2.0", "fftw3": "GPL-2.0-or-later", "gcc": "GPL-3.0-or-later WITH GCC-exception-3.1", "glibc": "LGPL-2.1-or-later",
    "glm": "MIT", "googletest": "BSD-3-Clause", "hdf5": "BSD-3-Clause", "highway": "Apache-2.0", "icu": "ICU",
    "insighttoolkit": "Apache-2.0 AND GPL-2.0-or-later", "libaec": "BSD-2-Clause", "libdeflate": "MIT", "libjpeg-turbo": "IJG AND BSD-3-Clause AND Zlib",
    "libpng": "Libpng", "libxml": "MIT", "minizip": "Zlib", "linux": "GPL-2.0-only WITH Linux-syscall-note", "nlohmann-json": "MIT", "numpy": "BSD-3-Clause", "onetbb": "Apache-2.0",
    "openjpeg": "BSD-2-Clause", "openssl": "Apache-2.0", "tomlplusplus": "MIT", "python": "PSF-2.0", "python3-defaults": "PSF-2.0",
    "vtk": "BSD-3-Clause", "xz-utils": "LicenseRef-public-domain", "zlib": "Zlib",
}


def fail(text):
    raise SystemExit(f"sbom.py: error: {text}")


def output_of(*command):
    """What a command prints; no output where it fails, as dpkg does where it does not know one of many."""
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=False).stdout


def spdx_id(*names):
    return "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]+", "-", "-".join(names))


class Document:
    """The packages of a bill of materials, and how they hang together."""

    def __init__(self, commit):
        self.commit = commit
        self.packages = {}
        self.relations = set()

    def artifact(self, path, licence, purpose, version):
        """A file of the release. Returns its id."""
        identifier = spdx_id("File", path.name)
        self.packages[identifier] = {
            "SPDXID": identifier, "name": path.name, "versionInfo": version, "packageFileName": path.name, "supplier": "Organization: The Tetwarp authors",
            "downloadLocation": "NOASSERTION", "filesAnalyzed": False, "primaryPackagePurpose": purpose,
            "sourceInfo": f"made of commit {self.commit}",
            "checksums": [{"algorithm": "SHA256", "checksumValue": hashlib.sha256(path.read_bytes()).hexdigest()}],
            "licenseConcluded": "NOASSERTION", "licenseDeclared": licence, "copyrightText": "The Tetwarp authors"}
        self.relations.add(("SPDXRef-DOCUMENT", "DESCRIBES", identifier))
        return identifier

    def debian(self, package):
        """A package of Debian that is installed here. Returns its id."""
        line = output_of("dpkg-query", "-W", "-f", "${source:Package} ${Version} ${Architecture}\n", package).splitlines()
        if not line:
            fail(f"the package {package} is not installed, so its version is not known")
        source, version, architecture = line[0].split()
        licence = LICENCES.get(source) or LICENCES.get(re.sub(r"[-0-9.]+$", "", source))
        if not licence:
            fail(f"no licence is known for {package} (source {source}); look into /usr/share/doc/{package}/copyright and name it in sbom.py")
        identifier = spdx_id("Debian", package)
        self.packages[identifier] = {
            "SPDXID": identifier, "name": package, "versionInfo": version, "supplier": "Organization: Debian",
            "downloadLocation": "NOASSERTION", "filesAnalyzed": False, "licenseConcluded": "NOASSERTION",
            "licenseDeclared": licence, "copyrightText": "NOASSERTION",
            "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
                              "referenceLocator": f"pkg:deb/debian/{package}@{version}?arch={architecture}"}]}
        return identifier

    def nanobind(self, version):
        identifier = spdx_id("PyPI", "nanobind")
        self.packages[identifier] = {
            "SPDXID": identifier, "name": "nanobind", "versionInfo": version, "supplier": "Person: Wenzel Jakob",
            "downloadLocation": "NOASSERTION", "filesAnalyzed": False, "licenseConcluded": "NOASSERTION",
            "licenseDeclared": "BSD-3-Clause AND MIT", "copyrightText": "NOASSERTION",
            "comment": "with robin-map, which is under MIT",
            "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
                              "referenceLocator": f"pkg:pypi/nanobind@{version}"}]}
        return identifier

    def json(self, name, date):
        packages = [self.packages[key] for key in sorted(self.packages)]
        relations = [{"spdxElementId": a, "relationshipType": kind, "relatedSpdxElement": b} for a, kind, b in sorted(self.relations)]
        content = json.dumps([packages, relations], sort_keys=True)
        others = [{"licenseId": "LicenseRef-public-domain", "name": "Public domain",
                   "extractedText": "liblzma is in the public domain; see /usr/share/doc/liblzma5/copyright of Debian."}]
        return {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": name,
                "documentNamespace": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, name + content)}",
                "creationInfo": {"created": date.strftime("%Y-%m-%dT%H:%M:%SZ"), "creators": ["Tool: tetwarp-sbom", "Organization: The Tetwarp authors"]},
                "hasExtractedLicensingInfos": others, "packages": packages, "relationships": relations}


def owners(paths):
    """The packages of Debian that files belong to."""
    paths = sorted({os.path.realpath(path) for path in paths})
    found = output_of("dpkg", "-S", *paths)
    owned = dict(reversed(line.rsplit(": ", 1)) for line in found.splitlines() if not line.startswith("diversion"))
    missing = [path for path in paths if path not in owned]
    if missing:
        fail(f"files that no package of Debian has were compiled in: {', '.join(missing[:5])}")
    return sorted({owner.split(",")[0].split(":")[0] for owner in owned.values()})


def headers_of(build, source):
    """Files that the compiler read in a build: those outside of the sources for what is no module of Python, and the same
    for the module, without those of nanobind."""
    log = output_of("ninja", "-C", str(build), "-t", "deps")
    if not log:
        fail(f"{build} has no log of ninja; run cmake/debian/build.sh and python/wheels.sh in {source}")
    names, module = set(), set()
    read = names
    for line in log.splitlines():
        if line.startswith("    "):
            read.add(line.strip())
        elif line:
            read = module if line.startswith(("python/", "nanobind", "CMakeFiles/nanobind")) else names
    bound = {name for name in module | names if "/nanobind/" in name}

    def outside(read):
        return {name for name in read - bound if name.startswith("/") and not name.startswith(f"{source}/")}
    return outside(names), outside(module)


def has_headers_alone(package):
    """Whether a package of Debian has no library that a program could be linked with."""
    return not re.search(r"/lib\S*\.(so|a)$", output_of("dpkg", "-L", package), re.M)


def wheel_build(source, wheel):
    """The folder in which a wheel was built: scikit-build-core names it after the wheel before auditwheel gave it another platform."""
    interpreter, abi = wheel.stem.split("-")[2:4]
    found = sorted((source / "build").glob(f"{interpreter}-{abi}-linux_*"))
    return found[0] if len(found) == 1 else fail(f"{len(found)} folders of {source}/build are of {wheel.name}, where one should be")


def nanobind_version(build):
    """What a build says of the nanobind that it used (python/CMakeLists.txt)."""
    path = build / "python" / "nanobind.txt"
    return path.read_text(encoding="utf-8").strip() if path.exists() else fail(f"{path} is missing: with which nanobind was this built?")


def loaded_by_wheel(path):
    """Names of the shared libraries that auditwheel put into a wheel, without the hash that it gave them."""
    with zipfile.ZipFile(path) as wheel:
        for name in wheel.namelist():
            if ".libs/" in name and not name.endswith("/"):
                yield re.sub(r"-[0-9a-f]{8}(?=\.so|-|\.)", "", pathlib.PurePosixPath(name).name)


def package_of_library(soname):
    """The package of Debian that has a shared library."""
    for line in output_of("dpkg", "-S", f"*/{soname}*").splitlines():
        package, path = line.rsplit(": ", 1)
        if pathlib.PurePosixPath(path).name.startswith(soname):
            return package.split(",")[0].split(":")[0]
    return fail(f"no package of Debian has {soname}, which a wheel holds")


def main():
    if sys.argv[1:2] == ["--check"]:
        checked = Document("")
        for package in sys.argv[2:]:
            checked.debian(package)
        return
    if len(sys.argv) != 3:
        raise SystemExit(__doc__.split("\n\n")[1].strip())
    source, folder = (pathlib.Path(argument).resolve() for argument in sys.argv[1:])
    version = re.search(r"^project\(tetwarp VERSION ([0-9.]+)", (source / "CMakeLists.txt").read_text(encoding="utf-8"), re.M).group(1)
    commit = output_of("git", "-C", str(source), "rev-parse", "HEAD").strip()
    document = Document(commit)

    def compiled_with(artifact, headers, binds=None):
        for package in owners(headers):
            other = document.debian(package)
            document.relations.add((artifact, "STATIC_LINK", other) if has_headers_alone(package) else (other, "BUILD_DEPENDENCY_OF", artifact))
        if binds:
            document.relations.add((artifact, "STATIC_LINK", document.nanobind(nanobind_version(binds))))

    packages_build = source / "build" / "debian"
    headers, module_headers = headers_of(packages_build, source)
    for path in sorted(folder.iterdir()):
        if path.name.endswith(".deb"):
            fields = dict(line.split(": ", 1) for line in output_of("dpkg-deb", "-f", str(path)).splitlines() if re.match(r"\S+: ", line))
            package = fields["Package"]
            gpl = " AND GPL-2.0-or-later" if "insighttoolkit" in fields.get("Depends", "") else ""
            artifact = document.artifact(path, "Apache-2.0" + gpl, "INSTALL", version)
            if package.startswith("python3-"):
                compiled_with(artifact, headers | module_headers, packages_build)
            elif package != "tetwarp-doc":
                compiled_with(artifact, headers)
            for entry in filter(None, fields.get("Depends", "").split(", ")):
                name = entry.split()[0]
                if "tetwarp" not in name:
                    document.relations.add((artifact, "DEPENDS_ON", document.debian(name)))
        elif path.suffix == ".whl":
            artifact = document.artifact(path, "Apache-2.0", "LIBRARY", version)
            build = wheel_build(source, path)
            library_headers, its_headers = headers_of(build, source)
            compiled_with(artifact, library_headers | its_headers, build)
            for soname in loaded_by_wheel(path):
                document.relations.add((artifact, "CONTAINS", document.debian(package_of_library(soname))))
        elif path.name == f"tetwarp-{version}.tar.xz":
            document.artifact(path, "Apache-2.0", "SOURCE", version)
        elif path.name.endswith(".tar.xz"):
            document.artifact(path, "Apache-2.0", "ARCHIVE", version)
    date = datetime.datetime.fromtimestamp(int(os.environ["SOURCE_DATE_EPOCH"]), datetime.timezone.utc)
    json.dump(document.json(f"tetwarp-{version}", date), sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
