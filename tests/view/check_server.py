#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Tries to break the rules of the viewer's server, and uses it as a page does.

    check_server.py PROGRAM

Each function whose name begins with a claim is a test; the exit status is 1 if one fails.
"""
import glob
import json
import pathlib
import shlex
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import time

from client import Page, Program, Refused, grey_pixels, request

PROGRAM = None


def head(answer):
    return answer.split("\r\n")[0]


def get(program, path="/", host=None, method="GET", more="", to="127.0.0.1"):
    own = f"127.0.0.1:{program.port}" if host is None else host
    return request(program.port, f"{method} {path} HTTP/1.1\r\nHost: {own}\r\nConnection: close\r\n{more}\r\n", to)


def refused(program, **how):
    try:
        with Page(program, **how):
            return ""
    except Refused as error:
        return str(error)


def expect(what, message):
    if not what:
        raise AssertionError(message)


def expect_seen(page, path):
    """What the page shows of the axial slice is what stands in a file, pixel for pixel."""
    about, rows = page.exact("axial")
    header, _, voxels = path.read_bytes().partition(b"ElementDataFile = LOCAL\n")
    expect(b"ElementType = MET_SHORT" in header, header)
    width, height, _ = (int(n) for n in header.split(b"DimSize = ")[1].split(b"\n")[0].split())
    voxel = about["voxel"]
    values = struct.unpack(f"<{width * height}h", voxels[2 * width * height * voxel:2 * width * height * (voxel + 1)])
    low = page.state["level"] - page.state["width"] / 2
    grey = [min(255, max(0, int((v - low) / page.state["width"] * 255 + 0.5))) for v in values]
    shown = [pixel for row in rows for pixel in row]
    different = sum(abs(a - b) > 1 for a, b in zip(grey, shown))
    expect(len(shown) == len(grey) and different == 0, f"{different} of {len(grey)} pixels differ from {path.name}")
    expect(len(set(shown)) > 30, "an empty picture")


def files_of_the_page_come_with_headers_that_forbid_the_rest(program, _):
    page = get(program)
    expect(" 200 " in head(page), head(page))
    for line in ("Content-Security-Policy: default-src 'none'", "frame-ancestors 'none'", "Cache-Control: no-store",
                 "X-Content-Type-Options: nosniff", "Referrer-Policy: no-referrer", "charset=utf-8"):
        expect(line in page, f"no {line}")
    expect("Access-Control" not in page, "a page of another place may read it")
    expect(program.token not in page, "the page has the token in it")
    for path in ("/main.js", "/view.css", "/icon.svg"):
        expect(" 200 " in head(get(program, path)), path)
    answer = get(program, method="HEAD")
    expect(answer.endswith("\r\n\r\n") and "Content-Length: 0" not in answer, "HEAD has no length, or a body")


def another_name_of_this_machine_is_refused(program, _):
    for host in ("", "evil.org", f"evil.org:{program.port}", f"127.0.0.1.evil.org:{program.port}", "127.0.0.1:80"):
        expect(" 421 " in head(get(program, host=host)), f"host {host!r}")
    no_host = request(program.port, "GET / HTTP/1.1\r\nConnection: close\r\n\r\n")
    expect(" 421 " in head(no_host), "no host")
    two = get(program, more="Host: evil.org\r\n")
    expect(" 200 " not in head(two), "two hosts")
    expect(" 403 " in refused(program, host="evil.org"), "the WebSocket takes any host")


def pages_of_other_places_open_no_websocket(program, _):
    for origin in ("", "null", "http://evil.org", f"https://127.0.0.1:{program.port}", "http://127.0.0.1:1"):
        expect(" 403 " in refused(program, origin=origin), f"origin {origin!r}")
    for own in (f"http://127.0.0.1:{program.port}", f"http://localhost:{program.port}"):
        expect(refused(program, origin=own) == "", own)


def no_path_leads_to_a_file(program, _):
    for path in ("/etc/passwd", "/../../../etc/passwd", "/..%2f..%2fetc/passwd", "//etc/passwd", "/main.js/..", "/%00",
                 "/index.html", "/tsconfig.json", "/main.js?x=1"):
        expect(" 404 " in head(get(program, path)), path)
    for method in ("POST", "PUT", "DELETE", "OPTIONS", "TRACE", "CONNECT"):
        expect(" 200 " not in head(get(program, method=method)), method)


def damaged_and_endless_requests_end(program, _):
    for text in (b"\x00" * 1000, b"GET / HTTP/9.9\r\n\r\n", b"GET " + b"/" * 20000 + b" HTTP/1.1\r\n\r\n",
                 b"GET / HTTP/1.1\r\n" + b"A: b\r\n" * 5000 + b"\r\n",
                 f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{program.port}\r\nContent-Length: 99999999\r\n\r\n".encode()):
        expect(" 200 " not in head(request(program.port, text)), text[:30])
    begun = time.time()
    with socket.create_connection(("127.0.0.1", program.port)) as line:  # says nothing
        line.settimeout(30)
        expect(line.recv(1) == b"", "a silent connection got something")
    expect(time.time() - begun < 20, "a silent connection stays")
    expect(" 200 " in head(get(program)), "the server is gone")


def only_this_machine_is_listened_to(program, _):
    listening = pathlib.Path("/proc/net/tcp").read_text() + pathlib.Path("/proc/net/tcp6").read_text()
    port = f"{program.port:04X}"
    addresses = {line.split()[1].split(":")[0] for line in listening.splitlines()[1:]
                 if len(line.split()) > 3 and line.split()[1].endswith(":" + port) and line.split()[3] == "0A"}
    expect(addresses <= {"0100007F", "00000000000000000000000001000000"} and "0100007F" in addresses, addresses)
    if "00000000000000000000000001000000" in addresses:
        expect(" 200 " in head(get(program, host=f"[::1]:{program.port}", to="::1")), "no answer on ::1")


def a_page_without_the_token_is_sent_away(program, _):
    for token in ("", "0" * 64, program.token[:-1], program.token + "0", program.token.upper() + "x"):
        with Page(program, token=token) as page:
            page.listen(5)
            expect(page.closed == 1008, f"{token[:5]!r}: {page.closed}")
            expect(page.about is None and not page.pictures, "it got something")
    with Page(program, hello=False) as page:
        page.ask("undo")
        page.listen(5)
        expect(page.closed == 1008 and page.about is None, "it may ask without a token")


def messages_that_are_none_end_the_connection(program, _):
    for text in ("", "hello", "{", "[1]", '{"do": "format"}', '{"do": "undo", "x": 1}', '{"do": "look", "at": [1]}',
                 "[" * 60000):
        with Page(program) as page:
            page.listen(5, lambda p: p.about)
            page.send(text)
            page.listen(5)
            expect(page.closed == 1008, f"{text[:30]!r}: {page.closed}")
    with Page(program) as page:
        page.listen(5, lambda p: p.about)
        page.send(" " * 70000)
        page.listen(5)
        expect(page.closed in (1009, 1006), f"a long one: {page.closed}")
    with Page(program) as page:
        page.listen(5, lambda p: p.about)
        page.send(b'\xff\xfe{"do"')
        page.listen(5)
        expect(page.closed is not None, "text that is no UTF-8")


def a_page_that_sends_too_much_is_sent_away(program, _):
    with Page(program) as page:
        page.listen(5, lambda p: p.about)
        try:
            for _ in range(6000):
                page.ask("move", by=[0, 0, 0])
        except (BrokenPipeError, ConnectionResetError):
            pass
        page.listen(10)
        expect(page.closed is not None, "it may send as much as it likes")


def a_second_page_is_told_and_may_take_over(program, _):
    with Page(program) as first:
        first.sizes(64, 64, 64)
        first.rest()
        with Page(program) as second:
            second.listen(5)
            expect(second.closed == 1013 and second.messages[-1]["text"] == "another page is open", second.messages)
        first.ask("probe", at=first.about["middle"])
        expect(first.answer(first.number), "the first page lost the line")
        with Page(program, take=True) as third:
            third.sizes(64, 64, 64)
            third.rest()
            first.listen(5)
            expect(first.closed == 1001 and "took over" in first.messages[-1]["text"], first.messages[-1])


def a_lost_line_comes_back_with_all_that_was_done(program, _):
    with Page(program) as page:
        page.sizes(64, 64, 64)
        page.rest()
        page.ask("grip", at=page.about["middle"], radius=30)
        page.ask("move", by=[8, 0, 0])
        page.listen(20, lambda p: p.state and p.state["frames"] > 2)
        page.line.close()  # without a word
    with Page(program, take=True) as page:
        page.sizes(64, 64, 64)
        page.rest()
        expect(page.state["frames"] > 2 and page.state["holds"], page.state)
        page.ask("reset")
        page.rest()


def a_page_that_reads_slowly_gets_the_latest_and_holds_up_nobody(program, _):
    with Page(program, acknowledges=False) as page:
        page.sizes(64, 64, 64)
        page.listen(3)
        first = len(page.pictures)
        expect(4 <= first <= 8, f"{first} pictures, though none was said to be shown")  # some were under way already
        for n in range(50):
            page.ask("turn", angle=n, elevation=0, zoom=1)
            page.listen(0.02)
        page.listen(1)
        expect(len(page.pictures) == first, "pictures pile up")
        page.acknowledges = True
        for _, about, _ in list(page.pictures):
            page.send(json.dumps({"do": "shown", "pane": about["pane"], "number": about["number"]}))
        page.listen(20, lambda p: any(a["request"] >= p.number for _, a, _ in p.pictures if a["pane"] == "volume"))
        shown = [a["request"] for _, a, _ in page.pictures if a["pane"] == "volume"]
        expect(shown[-1] >= page.number and len(shown) < 10, shown)


def what_was_done_is_saved_and_repeated_to_the_same_bits(program, folder):
    with Page(program) as page:
        page.sizes(64, 64, 64)
        page.rest()
        at = page.about["middle"]
        page.ask("grip", at=[at[0], at[1] - 60, at[2]], radius=30)
        for n in range(1, 6):
            page.ask("move", by=[3.0 * n, -2.0 * n, 0])
            page.listen(0.1)
        page.rest()
        for name in ("../a", "a/b", "", "-a", "a.b", "a" * 65, "/etc/a"):
            answer = page.save(name, "")
            expect(answer["say"] == "problem", f"{name!r}: {answer}")
        expect(not folder.exists() or not list(folder.iterdir()), list(folder.parent.rglob("*")))
        saved = page.save("hand", ".mha")
        expect(saved["say"] == "saved", saved)
        expect_seen(page, folder / "hand.mha")
        for line in saved["command"].splitlines():
            words = line.replace("tetwarp", PROGRAM, 1).replace("hand.mha", "again.mha").split()
            if not (folder / "phantom.nii.gz").exists() or "phantom" not in words[1]:
                subprocess.run(words, check=True, cwd=folder.parent, capture_output=True)
        expect((folder / "hand.mha").read_bytes() == (folder / "again.mha").read_bytes(), "other bytes")
        expect("exist" in page.save("hand", "").get("text", ""), "a file was written over")
        expect(len(list(folder.iterdir())) >= 3 and not list(folder.glob(".*")), list(folder.iterdir()))
        page.ask("reset")
        page.rest()


def a_scenario_is_played_beside_what_the_hand_does(_, folder):
    scenario = folder.parent / "lift.json"
    scenario.write_text(json.dumps({
        "name": "lift", "method": "chainmail", "cell_size": 16,
        "tissues": [{"name": "all", "youngs_modulus_kpa": 10, "compression": 0.3, "stretch": 0.3, "shear": 0.5}],
        "hold": [{"border": True}], "frames": 6, "stop": {"motion_mm": 0.05, "residual": 0.001, "steps": 4},
        "move": [{"name": "front", "region": {"sphere": {"at": {"mm": [0, -90, 0]}, "radius_mm": 40}}, "by_mm": [0, -25, 0]}]}))
    with Program(PROGRAM, "--demo", "--scenario", scenario, "-o", folder / "played") as program, Page(program) as page:
        page.sizes(64, 64, 64)
        page.rest()
        expect(page.state["playable"], page.state)
        page.ask("play")
        page.listen(30, lambda p: p.state["frames"] >= 6 and not p.state["plays"])
        page.ask("grip", at=[60, 0, 0], radius=20)
        page.ask("move", by=[9, 0, 0])
        page.listen(20, lambda p: p.state["frames"] >= 8)
        page.rest()
        saved = page.save("lift", ".mha")
        expect(saved["say"] == "saved", saved)
        expect_seen(page, folder / "played" / "lift.mha")
        for name in ("lift.json", "lift.mha", "lift.mha.json", "phantom.nii.gz"):
            (folder / "played" / name).unlink(missing_ok=True)
        (folder / "played").rmdir()


def repeat(saved, folder, renamed):
    """Runs the commands that the page shows. @param renamed  other names of files, by those that are there"""
    for line in saved["command"].splitlines():
        words = shlex.split(line)
        if words[1] == "phantom":
            continue  # it is there already
        words = [PROGRAM, *words[1:]]
        for before, after in renamed.items():
            words = [word.replace(before, after) for word in words]
        words = [match for word in words for match in (sorted(glob.glob(word)) if "*" in word else [word])]
        subprocess.run(words, check=True, cwd=folder.parent, capture_output=True)


def field_pictures_and_film_are_saved_and_made_again_by_their_commands(_, folder):
    here = folder.parent / "kept"
    with Program(PROGRAM, "--demo", "-o", here) as program, Page(program) as page:
        page.sizes(64, 64, 64)
        page.rest()
        page.ask("grip", at=page.about["middle"], radius=30)
        page.ask("move", by=[0, -12, 4])
        page.listen(20, lambda p: p.state["frames"] >= 6)
        page.ask("release")
        page.rest()
        saved = page.save("all", "", field=True, pictures=True)
        expect(saved["say"] == "saved", saved)
        names = {pathlib.Path(file).name for file in saved["files"]}
        expect(names == {"all.json", "all-field.mha", "all-axial.png", "all-coronal.png", "all-sagittal.png",
                         "all-volume.png"}, names)
        _, rows = page.exact("axial")
        expect(grey_pixels((here / "all-axial.png").read_bytes()) == rows, "another picture than the page shows")
        repeat(saved, here, {"all-field": "again-field", "all.nii.gz": "again.nii.gz"})
        expect((here / "all-field.mha").read_bytes() == (here / "again-field.mha").read_bytes(), "another field")
        expect("exists" in page.save("all", "", pictures=True).get("text", ""), "pictures were written over")
        film = page.save("film", "", film=".gif", of="axial")
        if not shutil.which("ffmpeg"):
            expect(film["say"] == "problem" and "ffmpeg" in film["text"], film)
            expect(not (here / "film.json").exists(), "something was written")
            return
        expect(film["say"] == "saved", film)
        expect((here / "film.gif").read_bytes()[:3] == b"GIF" and len(list(here.glob("film-film.*.mha"))) > 3, film)
        for path in (here / "film.gif", *here.glob("film-film*")):
            path.unlink()
        repeat(film, here, {"film.nii.gz": "film-again.nii.gz"})
        expect((here / "film.gif").exists(), "its commands make no film")


def a_given_field_is_shown_as_it_grows_and_saved(_, folder):
    here = folder.parent / "grown"
    with Program(PROGRAM, "--demo", "-f", "bubble:radius=90,strength=0.4", "--cell-size", "8", "-o", here) as program, \
            Page(program) as page:
        page.sizes(64, 64, 64)
        page.rest()
        expect(page.about["reel"] == 25 and page.about["grows"] and not page.about["pulls"], page.about)
        expect(page.state["frame"] == 24 and page.state["quality"]["jacobian"] < 1, page.state)
        whole = page.exact("axial")[1]
        page.ask("frame", number=0)
        page.listen(10, lambda p: p.state["frame"] == 0)
        page.rest()
        expect(page.exact("axial")[1] != whole and page.state["quality"]["jacobian"] == 1, "nothing grows")
        answer = page.answer(page.ask("grip", at=page.about["middle"], radius=20))
        expect(answer["say"] == "problem" and "hands work without it" in answer["text"], answer)
        page.ask("play")
        page.listen(20, lambda p: p.state["frame"] == 24 and not p.state["moving"])
        page.rest()
        expect(page.exact("axial")[1] == whole, "another whole field")
        saved = page.save("bubble", ".mha")
        expect(saved["say"] == "saved", saved)
        expect_seen(page, here / "bubble.mha")
        repeat(saved, here, {"bubble.mha": "again.mha"})
        expect((here / "bubble.mha").read_bytes() == (here / "again.mha").read_bytes(), "other bytes")
        if shutil.which("ffmpeg"):
            film = page.save("film", "", film=".mp4", of="coronal")
            expect(film["say"] == "saved" and (here / "film.mp4").stat().st_size > 1000, film)


def sequences_and_pull_fields_are_shown(_, folder):
    here = folder.parent / "shown"
    here.mkdir()
    run = lambda *words: subprocess.run([PROGRAM, *words], check=True, cwd=here, capture_output=True)
    run("phantom", "-o", "p.mha", "--size", "64,64,40", "--spacing", "6.4,6.4,7.5")
    for n in (1, 2, 3):
        run("deform", "p.mha", "-f", f"translate:by={7 * n}/0/0", "--cell-size", "16", "--outside", "background",
            "-o", f"d{n}.mha", "--write-field", f"f{n}.mha", "--inverse", f"i{n}.mha")
    with Program(PROGRAM, "p.mha", "--sequence", "f1.mha", "f2.mha", "f3.mha", "-o", "out", cwd=here) as program, \
            Page(program) as page:
        page.sizes(64, 64, 64)
        page.rest()
        expect(page.about["reel"] == 3 and not page.about["grows"] and page.state["frame"] == 0, page.state)
        coverage = [page.state["quality"]["coverage"]]
        for n in (1, 2):
            page.ask("frame", number=n)
            page.listen(10, lambda p: p.state["frame"] == n)
            page.rest()
            coverage.append(page.state["quality"]["coverage"])
        expect(coverage == sorted(coverage, reverse=True) and len(set(coverage)) == 3, coverage)
        saved = page.save("second", ".mha")
        expect(saved["say"] == "saved" and "-f f3.mha" in saved["command"], saved)
    with Program(PROGRAM, "p.mha", "--pull-field", "i2.mha", cwd=here) as program, Page(program) as page:
        page.sizes(64, 64, 64)
        page.rest()
        expect(page.about["pulls"] and page.state["quality"]["jacobian"] is None, page.state)
        answer = page.answer(page.ask("overlay", kind="folds"))
        expect("no tetrahedra" in answer.get("text", ""), answer)
    with Program(PROGRAM, "p.mha", "--sequence", "f1.mha", "f2.mha", cwd=here) as program, Page(program) as page:
        (here / "f2.mha").write_bytes((here / "f2.mha").read_bytes()[:300])  # cut off after it was named
        page.sizes(64, 64, 64)
        page.rest()
        answer = page.answer(page.ask("frame", number=1))
        expect(answer["say"] == "problem" and "f2.mha" in answer["text"], answer)
        page.rest()
        expect(page.state["frame"] == 0, "a frame that cannot be read is shown")


def a_series_and_a_film_of_a_cut_are_saved_and_made_again(_, folder):
    here = folder.parent / "series"
    here.mkdir()
    subprocess.run([PROGRAM, "phantom", "-o", "ct", "--size", "64,64,40", "--spacing", "6.4,6.4,7.5"], check=True, cwd=here,
                   capture_output=True)
    with Program(PROGRAM, "ct", "--series", "1", "-o", "out", cwd=here) as program, Page(program) as page:
        page.sizes(64, 64, 64)
        page.rest()
        page.ask("cut", path=[[-60, -60, 0], [60, -60, 0]], along=[0, 0, 1], depth=80, centred=True)
        page.ask("grip", at=[0, -80, 0], radius=40)
        page.ask("move", by=[0, -15, 0])
        page.listen(20, lambda p: p.state["frames"] >= 2 and not p.state["moving"])
        page.rest()
        saved = page.save("hand", "dicom", field=True)
        expect(saved["say"] == "saved" and "--series 1" in saved["command"], saved)
        expect(len(list((here / "out" / "hand-dicom").glob("*"))) == 40, "not all slices")
        expect((here / "out" / "hand-field.vtk").exists(), saved)
        for line in saved["command"].splitlines():
            words = [word.replace("hand-dicom", "again-dicom").replace("hand-field", "again-field") for word in shlex.split(line)]
            subprocess.run([PROGRAM, *words[1:]], check=True, cwd=here, capture_output=True)
        expect((here / "out" / "hand-field.vtk").read_bytes() == (here / "out" / "again-field.vtk").read_bytes(), "other field")
        if shutil.which("ffmpeg"):
            film = page.save("film", "", film=".gif", of="axial")
            expect(film["say"] == "saved" and (here / "out" / "film.gif").stat().st_size > 1000, film)
        failed = page.save("hand2", "dicom", film=".gif") if not shutil.which("ffmpeg") else None
        expect(failed is None or (failed["say"] == "problem" and not (here / "out" / "hand2.json").exists()), failed)


def labels_of_another_grid_are_refused(_, folder):
    here = folder.parent / "grids"
    here.mkdir()
    for name, size in (("p.mha", "64,64,40"), ("small.mha", "40,40,30")):
        subprocess.run([PROGRAM, "phantom", "-o", name, "--size", size], check=True, cwd=here, capture_output=True)
    for more in ([], ["-f", "twist:angle=20"]):
        done = subprocess.run([PROGRAM, "view", "p.mha", "--no-open", "--labels", "small.mha", *more], capture_output=True,
                              text=True, timeout=60, cwd=here)
        expect(done.returncode != 0 and "grid of the volume" in done.stderr, done)


def no_list_of_processes_shows_the_token(program, _):
    for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
        try:
            expect(program.token.encode() not in path.read_bytes(), path)
        except OSError:
            pass


def a_program_that_is_killed_leaves_nothing_half_written(_, folder):
    with Program(PROGRAM, "--demo", "-o", folder / "killed") as program, Page(program) as page:
        page.sizes(64, 64, 64)
        page.rest()
        page.ask("grip", at=page.about["middle"], radius=30)
        page.ask("move", by=[9, 0, 0])
        page.listen(10, lambda p: p.state and p.state["frames"] > 2)
        number = page.ask("save", name="hand", volume=".nii.gz")
        page.listen(10, lambda p: any(m.get("n") == number for m in p.messages))
        time.sleep(0.3)
        program.process.kill()
        program.process.wait()
    for path in (folder / "killed").iterdir():
        expect(path.name.startswith(".tetwarp-partial-") or path.stat().st_size > 100, f"half written: {path}")
        if path.suffix == ".json" and not path.name.startswith("."):
            json.loads(path.read_text())


def a_taken_port_is_an_error(program, _):
    done = subprocess.run([PROGRAM, "view", "--demo", "--no-open", "--port", str(program.port)], capture_output=True,
                          text=True, timeout=60)
    expect(done.returncode == 1 and "cannot listen" in done.stderr, done)
    done = subprocess.run([PROGRAM, "view", "--no-open"], capture_output=True, text=True, timeout=60)
    expect(done.returncode == 2 and "--demo" in done.stderr, done)


def main():
    global PROGRAM
    PROGRAM = str(pathlib.Path(sys.argv[1]).resolve())
    tests = [f for name, f in list(globals().items()) if "_" in name and callable(f) and f.__code__.co_varnames[:f.__code__.co_argcount] in (("program", "folder"), ("program", "_"), ("_", "folder"))]
    failed = 0
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch) / "saved"
        with Program(PROGRAM, "--demo", "-o", folder, cwd=scratch) as program:
            for test in tests:
                begun = time.time()
                try:
                    test(program, folder)
                    print(f"passed  {test.__name__}  ({time.time() - begun:.1f} s)", flush=True)
                except Exception as error:  # the next test says more
                    failed += 1
                    print(f"FAILED  {test.__name__}: {type(error).__name__} {error}", flush=True)
            if program.process.poll() is not None:
                failed += 1
                print("FAILED  the program has ended", program.process.returncode)
    print(f"{len(tests) - failed} of {len(tests)} passed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
