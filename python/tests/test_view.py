"""kerf.view(): the page on a session, by a browser made of a socket."""

import contextlib
import http.client
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
import urllib.request
from urllib.parse import urlsplit

import numpy as np
import pytest

import kerf

try:
    with kerf.Session("sheet") as tried, kerf.view(tried, open=False):
        pass
except kerf.Error as error:
    pytest.skip(str(error), allow_module_level=True)

HELLO, BODY, PATCH, FRAME, ROLE, ERROR, FILE = 1, 2, 3, 4, 8, 9, 11
CUT = [[[0, -0.10, 0.05], [0, -0.10, -0.05]], [[0, 0.02, 0.05], [0, 0.02, -0.05]]]
PATIENCE = 20  # s; no result depends on it

PROTOCOL = 7  # docs/protocol.md


class Page:
    """A page: HTTP and WebSocket by hand."""

    def __init__(self, url, *, token=True, host=None, origin=None, hello=True):
        place = urlsplit(url)
        self.socket = socket.create_connection((place.hostname, place.port), timeout=PATIENCE)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        lines = [f"GET /engine{'?' + place.query if token else ''} HTTP/1.1", f"Host: {host or place.netloc}", "Upgrade: websocket",
                 "Connection: Upgrade", "Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="]
        if origin:
            lines.append(f"Origin: {origin}")
        self.socket.sendall("\r\n".join([*lines, "", ""]).encode())
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += self.read(1)
        self.status = int(head.split()[1])
        if self.status == 101:
            assert b"s3pPLMBiTxaQ9kYGzzhZRbK+xOo=" in head
            if hello:
                self.say(64, struct.pack("<IIQII", PROTOCOL, 0, 0, 0, 0))

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.socket.close()

    def read(self, n):
        data = b""
        while len(data) < n:
            some = self.socket.recv(n - len(data))
            if not some:
                raise ConnectionError("the server has gone")
            data += some
        return data

    def say(self, kind, content, opcode=2):
        message = struct.pack("<HHI", kind, PROTOCOL, 8 + len(content)) + content
        mask = b"\x12\x34\x56\x78"
        size = bytes([0x80 | len(message)]) if len(message) < 126 else b"\xfe" + struct.pack(">H", len(message))
        self.socket.sendall(bytes([0x80 | opcode]) + size + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(message)))

    def hear(self):
        """(kind, content) of the next message. Frames are acknowledged."""
        first, size = self.read(2)
        if size > 125:
            size = int.from_bytes(self.read(2 if size == 126 else 8), "big")
        message = self.read(size)
        if first & 15 != 2:
            raise ConnectionError("the server says goodbye")
        kind, version, length = struct.unpack_from("<HHI", message)
        assert version == PROTOCOL and length == len(message)
        if kind == FRAME:
            self.say(65, struct.pack("<II", struct.unpack_from("<I", message, 12)[0], 0))
        return kind, message[8:]

    def until(self, *kinds, so=lambda content: True):
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            kind, content = self.hear()
            if kind in kinds and so(content):
                return content
        raise TimeoutError(f"no message {kinds}")

    def command(self, code, value=(0, 0, 0, 0), text=b"", number=7):
        self.say(68, struct.pack("<IIII4d", number, code, len(text), 0, *value) + text + bytes(-len(text) % 4))

    def frame(self, so=lambda content: True):
        """Time, flags and nodes of the next frame that is so."""
        content = self.until(FRAME, so=so)
        seconds, = struct.unpack_from("<d", content, 16)
        count, flags = struct.unpack_from("<II", content, 32)
        return seconds, flags, np.frombuffer(content, "<f4", 3 * count, 76).reshape(-1, 3)


def time_of(content):
    return struct.unpack_from("<d", content, 16)[0]


@pytest.fixture
def session():
    with kerf.Session("steak") as made:
        yield made


def is_free(port):
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
            probe.listen()
        except OSError:
            return False
    return True


def test_the_page_is_there(session):
    with kerf.view(session, open=False) as viewer:
        with urllib.request.urlopen(viewer.url, timeout=PATIENCE) as answer:
            assert "<title>Kerf" in answer.read().decode()
            policy = answer.headers["Content-Security-Policy"]
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/\?token=\w{32}", viewer.url) and str(viewer.port) in viewer.url
        assert viewer.url in repr(viewer) and viewer.session is session
        assert f'<iframe src="{viewer.url}"' in viewer._repr_html_() and "http://localhost:*" in policy.partition("frame-ancestors")[2]


def test_strangers_stay_out(session):
    with kerf.view(session, open=False) as viewer:
        port = viewer.port
        assert Page(viewer.url, token=False).status == 403
        assert Page(viewer.url[:-1] + ("0" if viewer.url[-1] != "0" else "1")).status == 403
        assert Page(viewer.url, host=f"example.org:{port}").status == 403
        assert Page(viewer.url, origin="http://example.org").status == 403
        assert Page(viewer.url, origin=f"http://127.0.0.1:{port}").status == 101


def test_the_page_sees_what_python_does(session):
    session.step(3)
    with kerf.view(session, open=False) as viewer, Page(viewer.url) as page:
        assert struct.unpack_from("<QII", page.until(HELLO))[2] == 1  # it may only watch
        body = struct.unpack_from("<8I", page.until(BODY))
        assert body[3] == len(session.triangles) and body[4] == 0 and body[6] == len(session.nodes)
        assert struct.unpack("<4I", page.until(ROLE)) == (0, 0, 1, 0)
        seconds, _, nodes = page.frame()
        assert seconds == session.time and np.allclose(nodes, session.nodes, atol=1e-7)
        session.step(20)
        seconds, flags, nodes = page.frame(lambda frame: time_of(frame) == session.time)
        assert flags & 1 and np.allclose(nodes, session.nodes, atol=1e-7)
        version = body[1]
        skin = walls = 0

        def follow():
            nonlocal version, skin, walls
            patch = struct.unpack_from("<9I", page.until(PATCH))
            assert patch[1] == version and patch[2] == version + 1
            version, (skin, walls) = patch[2], patch[5:7]

        assert session.cut(CUT)
        while skin + walls != len(session.triangles):
            follow()
        assert walls == np.count_nonzero(session.walls) > 0
        session.undo()
        while skin + walls != len(session.triangles):
            follow()
        assert walls == 0
        page.frame(lambda frame: struct.unpack_from("<I", frame, 8)[0] == version)


def test_a_page_that_comes_in_a_long_call_sees_it_go_on(session):
    with kerf.view(session, open=False) as viewer:
        run = threading.Thread(target=session.step, args=(1000,))
        run.start()
        with Page(viewer.url) as page:
            page.until(BODY)
            first = page.frame()[0]
            second = page.frame(lambda frame: time_of(frame) > first)[0]
            page.command(11, text=b"scene")
            file = page.until(FILE)
        run.join()
        assert first < second <= session.time == pytest.approx(1000 * session.time_step)
        assert b"[body]" in file


def test_the_session_is_python_s(session):
    with kerf.view(session, open=False) as viewer, Page(viewer.url) as page:
        page.until(ROLE)
        tool = struct.pack("<5If", 5, 0, 0, 0, 1, 0) + struct.pack("<7d2f", 0, 0, 0, 1, 0, 0, -1, 0.5, 0)
        for number, say in [(7, lambda: page.command(1)), (7, lambda: page.command(5)), (5, lambda: page.say(66, tool)),
                            (0, lambda: page.say(69, struct.pack("<II", 1, 0)))]:
            say()
            asked, code, size, _ = struct.unpack_from("<4I", error := page.until(ERROR))
            assert (asked, code) == (number, 3) and error[16:16 + size] == b"A program leads this session; pages watch."
        assert session.steps == 0 and session.undo_depth == 0


def test_a_page_changes_no_bit():
    def hashes(viewed):
        with kerf.Session("steak-on-a-board") as session, contextlib.ExitStack() as stack:
            if viewed:
                page = stack.enter_context(Page(stack.enter_context(kerf.view(session, open=False)).url))
                threading.Thread(target=listen, args=(page,), daemon=True).start()
            start = session.snapshot()
            found = []
            for _ in range(2):
                session.step(10)
                session.cut(CUT)
                session.step(10)
                kerf.Batch([session]).turn(5)
                found.append(session.hash)
                session.restore(start)
            return found

    def listen(page):
        with contextlib.suppress(OSError):
            while True:
                page.hear()

    assert hashes(True) == hashes(False)


def test_one_view_of_a_session(session):
    viewer = kerf.view(session, open=False)
    again = kerf.view(session, open=False)
    assert again is viewer and not viewer.closed
    assert kerf.view(session, open=False, port=viewer.port).url == viewer.url
    with pytest.raises(kerf.Error, match="viewed on port"):
        kerf.view(session, open=False, port=viewer.port % 60000 + 1024)
    again.close()
    assert viewer.closed and is_free(viewer.port) and "closed" in repr(viewer) and "iframe" not in viewer._repr_html_()
    with kerf.view(session, open=False, port=viewer.port) as other:
        assert other.port == viewer.port and other.url != viewer.url and viewer.closed
        viewer.close()
        assert not other.closed
        with kerf.Session("sheet") as second, pytest.raises(kerf.Error, match=f"port {viewer.port} is in use; give another as port="):
            kerf.view(second, open=False, port=viewer.port)
    session.step()


def test_what_can_not_be_viewed(session):
    with pytest.raises(TypeError):
        kerf.view("steak")
    with pytest.raises(TypeError):
        kerf.view(session, port="8080")
    with pytest.raises(ValueError):
        kerf.view(session, port=65536)
    viewer = kerf.view(session, open=False)
    with Page(viewer.url) as page:
        page.until(BODY)
        session.close()
        assert viewer.closed and is_free(viewer.port)
        with pytest.raises(OSError):
            while True:
                page.hear()
    viewer.close()
    with pytest.raises(kerf.Error, match="closed"):
        kerf.view(session, open=False)


def test_forgotten_sessions_are_not_served():
    port = kerf.view(kerf.Session("sheet"), open=False).port
    assert is_free(port)
    viewer = kerf.view(kerf.Session("sheet"), open=False)
    assert not viewer.closed and viewer.session.steps == 0
    viewer.close()


def test_the_browser_gets_a_ticket(session, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with kerf.view(session) as viewer:
        assert not opened
        kerf.view(session, open=True)
        token = urlsplit(viewer.url).query
        for status, place in [(303, f"/?{token}"), (200, None)]:
            assert token not in opened[0]
            ask = http.client.HTTPConnection("127.0.0.1", viewer.port, timeout=PATIENCE)
            ask.request("GET", "/?" + urlsplit(opened[0]).query)
            answer = ask.getresponse()
            assert (answer.status, answer.headers["Location"]) == (status, place)
            ask.close()
        monkeypatch.setenv("DISPLAY", ":0")
        kerf.view(session)
        assert len(opened) == 2 and opened[0] != opened[1]


def test_a_page_that_does_not_read_costs_little(session):
    def used():
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE")

    with kerf.view(session, open=False) as viewer, Page(viewer.url) as page:
        page.until(FRAME)
        before = used()
        for _ in range(300):
            session.step()
            time.sleep(0.002)
        assert used() - before < 64 << 20
        session.cut(CUT)
        page.until(PATCH)


def test_views_come_and_go_while_a_thread_works(session):
    end = threading.Event()

    def work():
        while not end.is_set():
            with contextlib.suppress(kerf.Error):  # while the other thread begins a view
                session.step()
            time.sleep(0.002)

    seen, steps = 0, session.steps
    run = threading.Thread(target=work)
    run.start()
    try:
        stop = time.monotonic() + PATIENCE
        while seen < 5 and time.monotonic() < stop:
            with contextlib.suppress(kerf.Error):  # while the other thread is in it
                with kerf.view(session, open=False) as viewer, Page(viewer.url) as page:
                    page.until(BODY)
                    seen += 1
    finally:
        end.set()
        run.join()
    assert seen == 5 and session.steps > steps and session.cut(CUT)


def program(text, **options):
    return subprocess.Popen([sys.executable, "-c", text], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def test_nothing_is_left_at_the_end():
    with program("""
import kerf
session = kerf.Session("steak")
other = kerf.Session("sheet")
viewer = kerf.view(session, open=False)
kerf.view(other, open=False)
print(viewer.url, flush=True)
input()
""", stdin=subprocess.PIPE) as child:
        url = child.stdout.readline().strip()
        with Page(url) as page:
            page.until(BODY)
            _, said = child.communicate("\n", timeout=PATIENCE)
    assert child.returncode == 0 and not said, said
    assert is_free(urlsplit(url).port)


@pytest.mark.parametrize("call", ["session.step(10**9)", "time.sleep(1000)"])
def test_ctrl_c_ends_it(call):
    with program(f"""
import kerf, signal, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # shells start what runs in the background without it
session = kerf.Session("steak")
print(kerf.view(session, open=False).url, flush=True)
{call}
""") as child:
        url = child.stdout.readline().strip()
        with Page(url) as page:
            page.until(FRAME)
            child.send_signal(signal.SIGINT)
            _, said = child.communicate(timeout=PATIENCE)
        assert "KeyboardInterrupt" in said and child.returncode in (1, 130, -signal.SIGINT)
    assert is_free(urlsplit(url).port)


def test_a_fork_leaves_the_page_to_the_parent():
    with program("""
import kerf, os, sys
session = kerf.Session("sheet")
viewer = kerf.view(session, open=False)
ready, say_ready = os.pipe()
end, say_end = os.pipe()
if os.fork() == 0:
    os.close(say_end)
    session.step()
    print(viewer.closed, session.steps, flush=True)
    os.write(say_ready, b"x")
    os.read(end, 1)  # until the parent has ended
    os._exit(0)
os.read(ready, 1)
print(viewer.closed, viewer.url, flush=True)
input()
viewer.close()
print("closed", flush=True)
input()
""", stdin=subprocess.PIPE) as child:
        assert child.stdout.readline() == "True 1\n"
        closed, url = child.stdout.readline().split()
        assert closed == "False"
        with Page(url) as page:
            page.until(BODY)
        child.stdin.write("\n")
        child.stdin.flush()
        assert child.stdout.readline() == "closed\n"
        free = is_free(urlsplit(url).port)
        child.communicate("\n", timeout=PATIENCE)
    assert free and child.returncode == 0
