# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""The viewer, used by a page that speaks as that of the browser does."""

import html
import http.server
import json
import os
import pathlib
import random
import re
import shutil
import signal
import socket
import subprocess
import sys
import textwrap
import threading
import time
import types

import numpy as np
import pytest
import tetwarp as tw
from test_behaviour import nonsense

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "view"))
from client import Page, request  # noqa: E402

HAS_VIEWER = tw.features()["viewer"]
viewer_only = pytest.mark.skipif(not HAS_VIEWER, reason="this build has no viewer")

SCENARIO = {
    "name": "lift", "method": "chainmail", "cell_size": 4,
    "tissues": [{"name": "soft", "label": 1, "compression": 0.3, "stretch": 0.3, "shear": 0.5},
                {"name": "rest", "compression": 0.5, "stretch": 0.5, "shear": 0.5}],
    "hold": [{"border": True}], "frames": 3,
    "move": [{"name": "middle", "region": {"sphere": {"at": {"body": [0.5, 0.5, 0.5]}, "radius_mm": 40}},
              "by_mm": [0, -15, 0]}],
}


class Server:
    """What a page has to know of a view."""

    def __init__(self, shown, token=None):
        base, own = shown.url.split("/#")
        self.port = int(base.rsplit(":", 1)[1])
        self.token = own if token is None else token


@pytest.fixture
def shown(ct, tmp_path):
    with tw.view(ct, backend="cpu", open=False, folder=tmp_path / "saved", cell_size=4) as view:
        yield view


def page_of(shown, **how):
    page = Page(Server(shown), **how)
    page.sizes(64, 64, 64)
    page.rest()
    return page


def pull(page, by=(12, -8, 0)):
    """Takes hold in the middle and pulls in some steps, until all is at rest."""
    number = page.ask("grip", at=page.about["middle"], radius=60)
    assert page.answer(number)["say"] == "held"
    before = page.state["frames"]
    for share in (0.4, 0.8, 1.0):
        page.ask("move", by=[share * part for part in by])
        page.listen(0.05)
    page.listen(20, lambda p: p.state["frames"] > before and not p.state["moving"])
    page.rest()


def same_field(one, other):
    return np.array_equal(np.asarray(one.displacement), np.asarray(other.displacement)) and one.lattice.size == other.lattice.size


def run_python(code, timeout=120, **environment):
    return subprocess.run([sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, timeout=timeout,
                          check=False, env=dict(os.environ, **environment))


@pytest.mark.skipif(HAS_VIEWER, reason="this build has the viewer")
def test_a_build_without_the_viewer_says_so(ct):
    with pytest.raises(tw.NotCompiled, match="viewer"):
        tw.view(ct)


@viewer_only
def test_what_a_hand_did_is_repeated_to_the_same_bits(ct, shown):
    assert shown.frames == 0 and shown.scenario is None
    assert not np.asarray(shown.field.displacement).any()
    with page_of(shown) as page:
        pull(page)
        first = shown.field
        assert np.abs(np.asarray(first.displacement)).max() > 5
        assert shown.frames == page.state["frames"] > 0
        copy = np.array(first.displacement)
        pull(page, by=(-10, 0, 5))
        assert np.array_equal(first.displacement, copy) and not same_field(first, shown.field)  # a copy stays
        page.ask("cut", path=[[x, page.about["middle"][1], page.about["middle"][2]] for x in (-60, 0, 60)],
                 along=[0, 0, 1], depth=80, centred=True)
        page.ask("move", by=[10, 10, 0])
        page.listen(20, lambda p: p.state["cuts"] and not p.state["moving"])
        page.rest()
        field, scenario = shown.field, shown.scenario
    run = tw.simulate(scenario, ct, backend="cpu")
    assert run.frames == shown.frames
    assert field.mesh is not None  # of the cut
    for one, other in ((run.field.mesh.displacement, field.mesh.displacement), (run.field.mesh.rest, field.mesh.rest),
                       (run.field.displacement, field.displacement), (run.field.replaced, field.replaced)):
        assert np.array_equal(one, other)
    shown.close()
    assert shown.scenario == scenario and shown.frames == run.frames  # they stay
    assert np.array_equal(shown.field.displacement, field.displacement)


@viewer_only
def test_the_page_saves_into_the_folder_and_nowhere_else(ct, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with tw.view(ct, backend="cpu", open=False, cell_size=4) as shown, page_of(shown) as page:
        assert page.about["folder"] == "tetwarp-view" and "dicom" not in page.about["volumes"]
        assert page.save("early", "")["say"] == "problem"
        pull(page)
        for name in ("../a", "a/b", "", "-a", "a.b", "a" * 65, "/etc/a", "a\n", "a\0", "ä"):
            assert page.save(name, "")["say"] == "problem", name
        for kind in ("dicom", ".png", "/../x.mha"):
            assert page.save("hand", kind)["say"] == "problem", kind
        assert not list(tmp_path.iterdir())
        saved = page.save("hand", ".mha")
        folder = tmp_path / "tetwarp-view"
        assert saved["say"] == "saved" and saved["files"] == [str(folder / "hand.json"), str(folder / "hand.mha")]
        assert json.loads((folder / "hand.json").read_text()) == shown.scenario
        expected = tw.deform(ct, shown.field).volume.array
        assert np.array_equal(tw.read(folder / "hand.mha").array, expected)
        for name, kind in (("hand", ""), ("hand", ".mha"), ("hand", ".nrrd")):
            assert "exist" in page.save(name, kind)["text"]
        assert {path.name for path in folder.iterdir()} == {"hand.json", "hand.mha"}  # nor anything half-written
        alone = page.save("alone", "")
        assert alone["files"] == [str(folder / "alone.json")]
        (folder / "hand.mha").unlink()
        exec(saved["command"], {"volume": ct})  # the lines that make it again
        assert np.array_equal(tw.read(folder / "hand.mha").array, expected)


@viewer_only
def test_field_and_pictures_are_saved_too(ct, tmp_path):
    with tw.view(ct, backend="cpu", open=False, cell_size=4, folder=tmp_path / "kept") as shown, page_of(shown) as page:
        assert page.about["films"] == []
        page.sizes(64, 64, 64)
        page.rest()
        early = page.save("early", "", pictures=True)  # what is seen can be kept before anything is done
        assert [path.split("-")[-1] for path in early["files"]] == ["axial.png", "coronal.png", "sagittal.png", "volume.png"]
        pull(page)
        saved = page.save("all", "", field=True, pictures=True)
        assert saved["say"] == "saved" and len(saved["files"]) == 6, saved
        kept = tw.read_field(tmp_path / "kept" / "all-field.mha")
        assert np.array_equal(kept.displacement, shown.field.displacement)
        assert "exist" in page.save("all", "", field=True)["text"]
        (tmp_path / "kept" / "all-field.mha").unlink()
        exec(saved["command"], {"volume": ct})
        again = tw.read_field(tmp_path / "kept" / "all-field.mha")
        assert np.array_equal(again.displacement, kept.displacement)


@viewer_only
def test_labels_lie_over_slices(ct):
    labels = tw.Volume((ct.array > -300).astype(np.uint8), ct.geometry)
    with tw.view(ct, labels=labels, backend="cpu", open=False, cell_size=4) as shown, page_of(shown) as page:
        del labels  # the viewer keeps what it shows
        assert page.about["labels"]
        page.sizes(64, 64, 64)
        page.rest()
        plain = [png for _, about, png in page.pictures if about["pane"] == "axial"][-1]
        for kind in ("labels", "contours"):
            page.ask("overlay", kind=kind)
            page.rest()
            assert [png for _, about, png in page.pictures if about["pane"] == "axial"][-1] != plain
        assert not [message for message in page.messages if message["say"] == "problem"]


@viewer_only
def test_a_series_is_saved_as_a_series(ct, tmp_path, monkeypatch):
    shown = tw.view(ct, backend="cpu", open=False)
    with shown, Page(Server(shown)) as page:
        page.listen(20, lambda p: p.about)
        assert page.about["volumes"] == [".nii.gz", ".mha", ".nrrd"]
    series = tw.Volume(ct.array, ct.geometry)
    series.series = object()
    shown = tw.view(series, backend="cpu", open=False)
    with shown, Page(Server(shown)) as page:
        page.listen(20, lambda p: p.about)
        assert page.about["volumes"][0] == "dicom"


@viewer_only
def test_a_scenario_is_played_and_the_labels_are_its_tissues(ct, tmp_path):
    labels = tw.Volume((ct.array > -200).astype(np.uint8), ct.geometry)
    path = tmp_path / "lift.json"
    path.write_text(json.dumps(SCENARIO))
    for scenario, cells in ((SCENARIO, None), (path, 2)):
        with tw.view(ct, scenario=scenario, labels=labels, cell_size=cells, backend="cpu", open=False) as shown:
            with page_of(shown) as page:
                page.ask("play")
                page.listen(30, lambda p: p.state["frames"] >= 3 and not p.state["plays"])
                page.rest()
            played, field = shown.scenario, shown.field
        assert played["cell_size"] == (cells or 4)
        assert [tissue["name"] for tissue in played["tissues"]] == ["soft", "rest"]
        run = tw.simulate(played, ct, labels=labels, backend="cpu")
        assert same_field(run.field, field) and np.asarray(field.displacement).any()


@viewer_only
def test_two_views_at_once_know_nothing_of_each_other(ct):
    with tw.view(ct, backend="cpu", open=False, cell_size=4) as one, tw.view(ct, backend="cpu", open=False, cell_size=4) as two:
        assert one.url != two.url
        with Page(Server(two, token=Server(one).token)) as page:
            page.listen(10)
            assert page.closed == 1008 and page.about is None
        with page_of(one) as first, page_of(two) as second:
            pull(first)
            assert one.frames > 0 and two.frames == 0
            pull(second, by=(0, 0, 9))
        assert not same_field(one.field, two.field)


@viewer_only
@pytest.mark.parametrize("backend", ["cuda"], indirect=True)
def test_a_view_on_a_device_gives_its_field_to_the_host(ct, backend):
    with tw.view(ct, backend=backend, open=False, cell_size=4) as shown, page_of(shown) as page:
        assert page.about["backend"] != "CPU"
        pull(page)
        field, scenario = shown.field, shown.scenario
    assert same_field(tw.simulate(scenario, ct, backend="cpu").field, field)


@viewer_only
def test_it_is_closed_once_and_says_what_it_had(ct, shown):
    with page_of(shown) as page:
        pull(page)
        url, frames = shown.url, shown.frames
        shown.close()
        page.listen(10)
        assert page.closed is not None
    shown.close()
    shown.wait()  # comes back at once
    assert shown.frames == frames and shown.url == url and "closed" in repr(shown)
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", Server(shown).port))


@viewer_only
def test_threads_may_ask_while_another_one_closes(ct):
    for _ in range(5):
        shown = tw.view(ct, backend="cpu", open=False, cell_size=8)
        askers = [threading.Thread(target=lambda: [(shown.frames, shown.field, shown.url) for _ in range(20)]) for _ in range(3)]
        closers = [threading.Thread(target=shown.close) for _ in range(2)]
        for thread in askers + closers:
            thread.start()
        for thread in askers + closers:
            thread.join(60)
            assert not thread.is_alive()


@viewer_only
def test_a_view_that_nobody_refers_to_ends(ct):
    shown = tw.view(ct, backend="cpu", open=False)
    port = Server(shown).port
    del shown
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", port))
    assert not [thread for thread in threading.enumerate() if thread.name == "tetwarp-view"]


PREAMBLE = f"""
import os, signal, sys, threading, time
sys.path.insert(0, {str(ROOT / "tests" / "view")!r})
sys.path.insert(0, {str(pathlib.Path(__file__).parent)!r})
import tetwarp as tw
from client import Page
ct = tw.phantom((40, 36, 20), spacing=(9.0, 9.5, 16.0))
class Server:
    def __init__(self, shown):
        base, self.token = shown.url.split("/#")
        self.port = int(base.rsplit(":", 1)[1])
"""


@viewer_only
@pytest.mark.parametrize("rest", [
    "",  # nobody looks
    "page = Page(Server(shown)); page.sizes(64, 64, 64); page.rest()\n"
    "page.ask('grip', at=page.about['middle'], radius=60); page.ask('move', by=[9, 0, 0])",  # it works
    "shown.close(); shown.close()",
    "threading.Thread(target=shown.wait, daemon=True).start()",
    "threading.Thread(target=lambda: [shown.frames for _ in iter(int, 1)], daemon=True).start(); time.sleep(0.2)",
    "pid = os.fork()\nif pid == 0: shown.close(); sys.exit(0)\nassert os.waitpid(pid, 0)[1] == 0; shown.frames",
    "pid = os.fork()\nif pid == 0:\n    try: shown.frames\n    except tw.Error: sys.exit(0)\n    sys.exit(1)\nassert os.waitpid(pid, 0)[1] == 0",
    "shown.myself = shown",  # a ring, which only the collector ends
    "raise SystemExit(0)",
])
def test_a_script_that_forgets_to_close_it_ends_by_itself(rest):
    begun = time.monotonic()
    result = run_python(PREAMBLE + "shown = tw.view(ct, backend='cpu', open=False)\n" + rest)
    assert result.returncode == 0 and result.stderr == "" and result.stdout == "", (result.returncode, result.stderr)
    assert time.monotonic() - begun < 60


@viewer_only
def test_what_is_being_saved_at_the_end_is_whole(tmp_path):
    result = run_python(
        PREAMBLE + f"""
big = tw.phantom((160, 160, 100), spacing=(2.5, 2.5, 3.5))
shown = tw.view(big, backend="cpu", open=False, folder={str(tmp_path)!r}, cell_size=16)
page = Page(Server(shown)); page.sizes(64, 64, 64); page.rest()
page.ask("grip", at=page.about["middle"], radius=60); page.ask("move", by=[9, 0, 0])
page.listen(20, lambda p: p.state["frames"] > 2)
number = page.ask("save", name="hand", volume=".mha")
page.listen(20, lambda p: any(m.get("n") == number for m in p.messages))
""")
    assert result.returncode == 0 and result.stderr == "", result.stderr
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"hand.json", "hand.mha"}
    assert tw.read(tmp_path / "hand.mha").array.shape == (100, 160, 160)


@viewer_only
def test_ctrl_c_ends_the_wait_and_closes():
    result = run_python(
        PREAMBLE + """
shown = tw.view(ct, backend="cpu", open=False)
threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
shown.wait()
print(shown.frames, repr(shown).endswith("closed>"))
""")
    assert result.stdout == "0 True\n" and result.stderr == "", result.stderr


@viewer_only
def test_python_goes_on_beside_it_and_it_beside_python():
    # Python's lock is held by a loop that gives it free only every 5 seconds; a page in another process is served.
    code = PREAMBLE + """
import subprocess
shown = tw.view(ct, backend="cpu", open=False)
page = subprocess.Popen([sys.executable, "-c", '''
import sys, time
sys.path.insert(0, sys.argv[1])
from client import Page
class Server:
    port, token = int(sys.argv[2]), sys.argv[3]
page = Page(Server()); page.sizes(64, 64, 64); page.rest()
page.ask("grip", at=page.about["middle"], radius=60)
page.ask("move", by=[9, 0, 0])
page.listen(20, lambda p: p.state["frames"] > 2)
''', sys.path[1], str(Server(shown).port), Server(shown).token])
sys.setswitchinterval(5)
end = time.monotonic() + 60
while page.poll() is None and time.monotonic() < end:
    sum(range(1000000))
print(page.wait(1), shown.frames > 2)
"""
    result = run_python(code)
    assert result.stdout == "0 True\n", result.stderr


@viewer_only
def test_what_cannot_be_looked_at_is_refused(ct, tmp_path):
    several = tw.Volume(np.zeros((4, 5, 6, 3), np.int16), tw.Geometry((6, 5, 4)))
    cases = [
        (tw.InputError, lambda: tw.view(several, open=False)),
        (TypeError, lambda: tw.view(np.zeros((4, 5, 6)), open=False)),
        (TypeError, lambda: tw.view("study", open=False)),
        (TypeError, lambda: tw.view(None, open=False)),
        (tw.InputError, lambda: tw.view(ct, labels=tw.phantom((8, 8, 8)), open=False)),
        (TypeError, lambda: tw.view(ct, labels=ct.array, open=False)),
        (tw.InputError, lambda: tw.view(ct, scenario={"name": "nothing"}, open=False)),
        (tw.InputError, lambda: tw.view(ct, scenario=tmp_path / "missing.json", open=False)),
        (tw.InputError, lambda: tw.view(ct, cell_size=0, open=False)),
        (tw.InputError, lambda: tw.view(ct, port=70000, open=False)),
        (tw.InputError, lambda: tw.view(ct, backend="quantum", open=False)),
    ]
    for number, (kind, call) in enumerate(cases):
        with pytest.raises(kind) as raised:
            call()
        assert str(raised.value), number
    with tw.view(ct, backend="cpu", open=False) as shown:
        with pytest.raises(tw.Error, match="cannot listen"):
            tw.view(ct, backend="cpu", open=False, port=Server(shown).port)
    assert not [thread for thread in threading.enumerate() if thread.name == "tetwarp-view"]


@viewer_only
def test_wrong_arguments_end_in_exceptions_of_ours(ct, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rng = random.Random(20261203)
    keys = ["scenario", "labels", "cell_size", "device", "threads", "folder", "port", "iframe"]
    for number in range(300):
        named = {key: nonsense(rng) for key in keys if rng.random() < 0.25}
        volume = ct if rng.random() < 0.5 else nonsense(rng)
        try:
            tw.view(volume, backend="cpu", open=False, **named).close()
        except (tw.Error, TypeError, MemoryError, FileNotFoundError) as error:
            assert str(error) or isinstance(error, MemoryError), (volume, named)
        except Exception as error:
            raise AssertionError(f"try {number}: view({volume!r}, **{named!r}) raised {error!r}") from error


# How a frame of a notebook is let in.


def framed(ct):
    return tw.view(ct, backend="cpu", open=False, iframe=True, cell_size=4)


def secret_of(page):
    assert page.listen(10, lambda p: p.about), page.messages
    said = [message["secret"] for message in page.messages if message["say"] == "secret"]
    return said[-1] if said else None


def sent_away(server, **how):
    with Page(server, **how) as page:
        page.listen(10)
        assert page.about is None and not page.pictures and secret_of_any(page) is None
        return page.closed


def secret_of_any(page):
    return next((message["secret"] for message in page.messages if message["say"] == "secret"), None)


def policy_of(server):
    answer = request(server.port, f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nConnection: close\r\n\r\n")
    return re.search("Content-Security-Policy: (.*)\r\n", answer)[1]


@viewer_only
def test_the_token_of_a_frame_works_once(ct):
    with framed(ct) as shown:
        server = Server(shown)
        with Page(server) as page:
            secret = secret_of(page)
            assert re.fullmatch("[0-9a-f]{64}", secret) and secret != server.token
            assert sent_away(server) == 1008  # the token that a saved notebook has
            assert sent_away(server, take=True) == 1008
            page.ask("probe", at=page.about["middle"])
            assert page.answer(page.number)  # nobody took its place
        for _ in range(2):  # the page comes back by what it was told, as often as its line is lost
            with Page(server, token=secret, take=True) as page:
                assert secret_of(page) is None
        assert sent_away(server, take=True) == 1008


@viewer_only
def test_a_page_that_did_not_get_in_has_not_used_its_token(ct):
    with framed(ct) as shown:
        with Page(Server(shown)) as page:
            first = secret_of(page)
            server = Server(shown)  # shown a second time
            assert sent_away(server) == 1013  # another page is open
            assert Server(shown).token == server.token
            with Page(server, take=True) as second:
                assert secret_of(second) not in (None, first)
                page.listen(10)
                assert page.closed == 1001
                assert sent_away(server, token=first, take=True) == 1008  # the first page has no say any more


@viewer_only
def test_wrong_tokens_of_a_frame_use_up_nothing(ct):
    with framed(ct) as shown:
        server = Server(shown)
        for token in ("", "0" * 64, server.token[:-1], server.token + "0", server.token.upper() + "x"):
            assert sent_away(server, token=token) == 1008
        assert Server(shown).token == server.token
        with Page(server) as page:
            assert secret_of(page)


@viewer_only
def test_a_saved_notebook_has_a_token_that_is_used_up(ct):
    with framed(ct) as shown:
        saved = shown._repr_html_()
        address = html.unescape(re.search('src="([^"]*)"', saved)[1])
        assert address == shown.url and address.startswith("http://127.0.0.1:")
        token = address.split("/#")[1]
        with Page(Server(shown)) as page:
            secret = secret_of(page)
            again = shown._repr_html_()
            assert token not in again and secret not in again and secret not in shown.url + repr(shown)
        assert token not in repr(shown)
        assert sent_away(Server(shown, token=token)) == 1008
    assert shown._repr_html_() is None  # closed


@viewer_only
def test_pages_of_this_machine_alone_may_frame_it_and_only_if_asked(ct, shown):
    with framed(ct) as frame:
        ancestors = policy_of(Server(frame)).split("frame-ancestors ")[1].split(";")[0].split()
        assert ancestors == ["http://127.0.0.1:*", "http://localhost:*"]
    assert "frame-ancestors 'none'" in policy_of(Server(shown))
    assert shown._repr_html_() is None


@viewer_only
def test_without_a_frame_the_token_stays(shown):
    server = Server(shown)
    for _ in range(2):
        with Page(server, take=True) as page:
            assert secret_of(page) is None
    assert Server(shown).token == server.token


@viewer_only
def test_in_a_browser_a_frame_keeps_its_secret_in_memory_alone(ct):
    playwright = pytest.importorskip("playwright.sync_api")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        pytest.skip("there is no Chromium")

    class Notebook(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(self.server.markup.encode())

        def log_message(self, *_):
            pass

    rests = """() => [...document.querySelectorAll('.pane')].every((p) => p.clientWidth === 0 || p.dataset.exact === 'true')"""
    with framed(ct) as shown, http.server.ThreadingHTTPServer(("127.0.0.1", 0), Notebook) as notebook:
        threading.Thread(target=notebook.serve_forever, daemon=True).start()
        notebook.markup = shown._repr_html_()  # as it is saved
        with playwright.sync_playwright() as start:
            browser = start.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
            page = browser.new_page(viewport={"width": 1400, "height": 900})
            page.goto(f"http://localhost:{notebook.server_address[1]}/")
            frame = page.frames[1]
            frame.wait_for_function(rests, timeout=60000)
            frame.evaluate("() => window.tetwarp.connection.socket.close()")  # the line is lost
            frame.wait_for_selector("#banner", state="visible", timeout=60000)
            frame.wait_for_selector("#banner", state="hidden", timeout=60000)
            frame.wait_for_function(rests, timeout=60000)
            secret = frame.evaluate("() => window.tetwarp.connection.token")
            assert len(secret) == 64 and secret not in notebook.markup + shown.url and "#" not in frame.url
            assert secret not in frame.content()
            page.reload()  # the frame comes with the token that it had
            page.frames[1].wait_for_function(
                "() => document.getElementById('banner').textContent.includes('has been used')", timeout=60000)
            notebook.markup = shown._repr_html_()  # shown again
            page.goto(f"http://127.0.0.1:{notebook.server_address[1]}/")  # where browsers give frames storage
            page.frames[1].wait_for_function(rests, timeout=60000)
            assert page.frames[1].evaluate("() => sessionStorage.length + localStorage.length + document.cookie.length") == 0
            tab = browser.new_page()  # a tab of its own forgets the token that it used, too
            tab.goto(shown.url)
            tab.wait_for_selector("#banner-button", state="visible", timeout=60000)
            tab.click("#banner-button")
            tab.wait_for_function(rests, timeout=60000)
            assert tab.evaluate("() => sessionStorage.length") == 0
            browser.close()
        notebook.shutdown()


# What is opened and said.


SHOW = PREAMBLE + "with tw.view(ct, backend='cpu'OPTIONS) as shown: print('-', shown.url, shown.ssh)"


@viewer_only
@pytest.mark.parametrize("far", [False, True])
@pytest.mark.parametrize("options", ["", ", open=True", ", open=False", ", iframe=True"])
def test_the_address_is_printed_where_no_browser_is_opened(far, options):
    environment = {"DISPLAY": "", "WAYLAND_DISPLAY": "", "SSH_CONNECTION": "1.2.3.4 5 6.7.8.9 22" if far else ""}
    cleared = "import os\nfor name in ('DISPLAY', 'WAYLAND_DISPLAY', 'SSH_CONNECTION'):\n    os.environ.get(name) or os.environ.pop(name, None)\n    os.environ.get(name) or os.unsetenv(name)\n"
    result = run_python(cleared + SHOW.replace("OPTIONS", options), **environment)
    assert result.returncode == 0, result.stderr
    *said, last = result.stdout.splitlines()
    _, url, ssh = last.split(" ", 2)
    port = url.split("/#")[0].rsplit(":", 1)[1]
    assert re.fullmatch(rf"ssh -N -L {port}:127\.0\.0\.1:{port} \S+" if far else "None", ssh)
    expected = []
    if options in ("", ", open=True"):
        expected.append(url)
    if far and options != ", open=False":
        expected.append("from your own machine: " + ssh + ("" if "iframe" in options else ", then open the address there"))
    assert said == expected


@viewer_only
@pytest.mark.parametrize("desktop", [False, True])
def test_a_kernel_without_a_desktop_is_on_a_far_machine(ct, monkeypatch, capsys, desktop):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SSH_CONNECTION"):
        monkeypatch.delenv(name, raising=False)
    if desktop:
        monkeypatch.setenv("DISPLAY", ":99")
    kernel = types.SimpleNamespace(get_ipython=lambda: types.SimpleNamespace(kernel=object()))
    for shell, far in ((kernel, not desktop), (types.SimpleNamespace(get_ipython=lambda: None), False)):
        monkeypatch.setitem(sys.modules, "IPython", shell)
        with tw.view(ct, backend="cpu", iframe=True) as shown:
            assert (shown.ssh is not None) == far
            assert capsys.readouterr().out == (f"from your own machine: {shown.ssh}\n" if far else "")


@viewer_only
@pytest.mark.parametrize("options, opens", [("", True), (", open=False", False), (", iframe=True", False)])
def test_the_browser_gets_the_address_by_a_file_that_others_cannot_read(tmp_path, options, opens):
    browser, seen = tmp_path / "browser", tmp_path / "seen"
    browser.write_text(f'#!/bin/sh\nstat -c %a "$(dirname "$1")" > {seen}.part\necho "$*" >> {seen}.part\ncat "$1" >> {seen}.part\nmv {seen}.part {seen}\n')
    browser.chmod(0o755)
    code = "import os; os.environ.pop('SSH_CONNECTION', None); os.environ.pop('WAYLAND_DISPLAY', None)\n" + SHOW.replace("OPTIONS", options).replace(": print", ":\n    print") + f"""
    import pathlib
    for _ in range(100 if {opens} else 5):
        if pathlib.Path({str(seen)!r}).exists(): break
        time.sleep(0.1)
"""
    result = run_python(code, DISPLAY=":99", BROWSER=str(browser))
    assert result.returncode == 0, result.stderr
    assert len(result.stdout.splitlines()) == 1  # nothing of its own
    url = result.stdout.split()[1]
    assert seen.exists() == opens
    if opens:
        mode, arguments, page = seen.read_text().split("\n", 2)
        assert mode == "700" and url in page and url.split("/#")[1] not in arguments
        assert not pathlib.Path(arguments).exists()  # gone with the view
