"""The explorer's page: machines put into the built page, and a server of it on this computer alone."""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from vibroimpact._core.columns import Split
from vibroimpact._core.errors import VibroImpactError
from vibroimpact.explorer.page_data import (
    Data,
    json_text,
    machine_data,
    packed_of,
    recording_of,
    text_of,
)
from vibroimpact.model.parameters import with_parameters
from vibroimpact.model.state import State
from vibroimpact.model.system import System
from vibroimpact.simulation.simulate import simulate

PAGE = Path(__file__).with_name(
    "page.html"
)  # `make explorer` puts it here; embed.js shows it in another page
PLACE = "<!--machines-->"
LOOPBACK = "127.0.0.1"
MOST_QUESTION = 1 << 16  # bytes
IMPACTS = 2000  # of the motion that says which modes are met
NOT_BUILT = (
    "the explorer's page is not part of this installation. In a clone of the sources, `make explorer` builds it "
    "with Node.js and npm; then install again."
)


def check_built() -> None:
    """Refuse where the page is not part of the installation."""
    if not PAGE.exists():
        raise VibroImpactError(NOT_BUILT)


def page_with(
    machines: Mapping[str, Data], chosen: str, others: Mapping[str, str] | None = None
) -> str:
    """The page with machines in it, as one HTML file that needs nothing else.

    Parameters
    ----------
    machines
        What :func:`~vibroimpact.explorer.page_data.machine_data` says of each, by name.
    chosen
        The one that is shown first.
    others
        Titles of the machines that the page asks :class:`Server` for, by name; None where it can ask nobody.

    Raises
    ------
    VibroImpactError
        The page is not built.
    """
    check_built()
    packed = gzip.compress(text_of(machines, chosen, others or {}).encode(), 9, mtime=0)
    parts = ['<meta id="server">'] * (others is not None)
    parts += [
        f'<script type="text/plain" id="machines">{base64.b64encode(packed).decode()}</script>'
    ]
    return PAGE.read_text(encoding="utf-8").replace(PLACE, "\n".join(parts), 1)


def answer_of(systems: Mapping[str, System], question: Mapping[str, Any]) -> Data:
    """What the page is told when it has no compilation for the values of its machine.

    Parameters
    ----------
    systems
        The machines, by the names that the page has.
    question
        Of the page: "machine", its name; "values" of its parameters; "start", with "x", "v" and "phase".

    Returns
    -------
    dict
        "recording", with the modes that the motion meets; or "refused", a sentence that says why there is none.
    """
    try:
        system, start = systems[question["machine"]], question["start"]
        values = {name: float(x) for name, x in question["values"].items()}
        state = State(tuple(start["x"]), tuple(start["v"]), float(start["phase"]))
        compiled = simulate(with_parameters(system, values), state, impacts=IMPACTS)._compiled
        codes = sorted(compiled.codes)
        return {"recording": packed_of(recording_of(system, values, codes, compiled.pace))}
    except (VibroImpactError, ArithmeticError) as error:
        return {"refused": str(error)}
    except (TypeError, ValueError, KeyError, AttributeError, Split):
        return {"refused": "These values cannot be compiled for the page."}


class Server(ThreadingHTTPServer):
    """Serves the page on this computer alone, and compilations of its machines at other values."""

    daemon_threads = True

    def __init__(self, page: str, systems: Mapping[str, System], port: int = 0) -> None:
        self.page, self.systems = page.encode(), dict(systems)
        super().__init__((LOOPBACK, port), _Answers)

    @property
    def address(self) -> str:
        """Address of the page."""
        return f"http://{LOOPBACK}:{self.server_address[1]}/"


class _Answers(BaseHTTPRequestHandler):
    """Answers of the server: the page, and recordings."""

    server: Server

    def do_GET(self) -> None:
        """Send the page, or a machine."""
        if not self._is_from_here():
            return
        path = self.path.partition("?")[0]
        name = path.removeprefix("/machine/")
        if path == "/":
            self._send(self.server.page, "text/html; charset=utf-8")
        elif path != name and name in self.server.systems:
            data = {name: machine_data(self.server.systems[name])}
            self._send(text_of(data, name, {}).encode(), "application/json")
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        """Send a recording, or a sentence that says why there is none."""
        if not self._is_from_here():
            return
        size = int(self.headers.get("Content-Length") or 0)
        if self.path != "/recording" or not 0 < size <= MOST_QUESTION:
            self.send_error(HTTPStatus.NOT_FOUND)
            return
        try:
            question = json.loads(self.rfile.read(size))
        except ValueError:
            question = {}
        answer = answer_of(self.server.systems, question)
        self._send(json_text(answer).encode(), "application/json")

    def _is_from_here(self) -> bool:
        """Whether this computer's own name was asked for: no site reads the page through another one."""
        host = (self.headers.get("Host") or "").rpartition(":")[0]
        if host in (LOOPBACK, "localhost"):
            return True
        self.send_error(HTTPStatus.FORBIDDEN)
        return False

    def _send(self, body: bytes, kind: str) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: Any) -> None:
        """Say nothing."""
