"""The page on a session."""

from __future__ import annotations

import atexit
import os
import sys
import weakref

from . import _arguments
from ._error import Error
from ._session import Session

# Pages of notebooks on this machine may show the page inside.
_NOTEBOOKS = "http://localhost:* http://127.0.0.1:* vscode-webview:"

# Sessions that are viewed, each with its Viewer as long as somebody has it.
_viewed: weakref.WeakKeyDictionary[Session, weakref.ref[Viewer]] = weakref.WeakKeyDictionary()


class Viewer:
    """The page on a session, made by kerf.view(). In a notebook it shows inside the cell that it is the value of.

    The page goes on without this object, until close(), the session's close(), or the end of Python. `with` closes it.
    """

    def __init__(self, session: Session) -> None:
        if not isinstance(session, Session):
            raise TypeError(f"session must be a kerf.Session, not {type(session).__name__}; kerf.view(session) makes viewers")
        self._session = session
        self._address = session._view_address()
        self._port = session._view_port()

    @property
    def url(self) -> str:
        """The page's address on this machine, for any browser here. Whoever has it can watch the session."""
        return self._address

    @property
    def port(self) -> int:
        """The port that it is served on."""
        return self._port

    @property
    def session(self) -> Session:
        """The session that it shows."""
        return self._session

    @property
    def closed(self) -> bool:
        """Is it served no more?"""
        return self._session._view_address() != self._address

    def close(self) -> None:
        """Ends the page and frees its port. The session goes on."""
        if not self.closed:
            self._session._close_view()

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return "<kerf.Viewer, closed>" if self.closed else f"<kerf.Viewer {self._address}>"

    def _repr_html_(self) -> str:
        if self.closed:
            return "<p>This page is closed; kerf.view(session) opens another one.</p>"
        return (f'<iframe src="{self._address}" title="Kerf" width="100%" height="520" '
                'style="border: 0" allow="fullscreen"></iframe>')


def view(session: Session, *, open: bool | None = None, port: int = 0) -> Viewer:
    """Shows a session in the page of `kerf view`, live: what Python does to it is seen there.

    The page watches. Steps and cuts are Python's; the visitor turns, looks through the views and exports, and has no tools.
    It is told between two steps, sixty times a second at most. While a cut or a picture is computed it stands still.
    A session has one page address, for as many browsers as like: for one that is viewed already its Viewer comes back.

    open: opens a browser. By default it does where there is a display, but not in a notebook: there the Viewer shows inside its cell.
    port: to serve on; 0: any that is free. The server listens on this machine alone, and the address ends with a token. For a browser
    elsewhere forward the port, under any number (ssh -L 9000:127.0.0.1:8000).
    kerf.Error: the session is closed, the port is in use, the session is viewed on another port, or the package has no page.
    """
    if not isinstance(session, Session):
        raise TypeError(f"session must be a kerf.Session, not {type(session).__name__}")
    port = _arguments.index(port, "port")
    if not 0 <= port <= 65535:
        raise ValueError(f"port must be from 0 to 65535, not {port}")
    if not session._view_address():
        import secrets

        session._open_view(port, secrets.token_hex(16), secrets.randbits(63) + 1, _NOTEBOOKS)
    elif port not in (0, session._view_port()):
        raise Error(f"this session is viewed on port {session._view_port()}; close that viewer before it is viewed on port {port}")
    known = _viewed.get(session)
    viewer = known and known()
    if viewer is None or viewer.closed:
        viewer = Viewer(session)
        _viewed[session] = weakref.ref(viewer)
    if open is None:
        open = _has_display() and not _in_notebook()
    if open:
        _open_browser(viewer)
    return viewer


def _has_display():
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _in_notebook():
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython else None
    return getattr(shell, "kernel", None) is not None


def _open_browser(viewer):
    import secrets
    import webbrowser

    ticket = secrets.token_hex(16)  # other users see command lines: this word is good once
    viewer._session._expect_page(ticket)
    webbrowser.open(f"{viewer.url.partition('?')[0]}?ticket={ticket}")


@atexit.register
def _close_all():
    for session in list(_viewed):
        session._close_view()


def _leave_to_parent():
    for session in list(_viewed):
        session._abandon_view()
    _viewed.clear()


os.register_at_fork(after_in_child=_leave_to_parent)

Viewer.__module__ = view.__module__ = "kerf"
