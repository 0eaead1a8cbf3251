"""The explorer's page: served on this computer alone, or written as a file."""

from __future__ import annotations

import base64
import gzip
import json
import re
import threading
from collections.abc import Iterator
from http.client import HTTPConnection
from pathlib import Path

import pytest

import vibroimpact as vi
from vibroimpact.cli import main as cli
from vibroimpact.explorer import page
from vibroimpact.explorer.page_data import machine_data, values_of

BALL = vi.machines.BouncingBall()


@pytest.fixture
def template(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A page that stands for the built one."""
    path = tmp_path / "page.html"
    path.write_text(f"<html>{page.PLACE}</html>")
    monkeypatch.setattr(page, "PAGE", path)
    return path


@pytest.fixture
def server(template: Path) -> Iterator[page.Server]:
    assert template.exists()
    with page.Server("the page", {"ball": BALL}) as one:
        thread = threading.Thread(target=one.serve_forever, daemon=True)
        thread.start()
        yield one
        one.shutdown()
        thread.join()


def asked(server: page.Server, path: str, body: str = "", host: str = "") -> tuple[int, bytes]:
    connection = HTTPConnection(*server.server_address[:2])
    headers = {"Host": host} if host else {}
    connection.request("POST" if body else "GET", path, body or None, headers)
    answer = connection.getresponse()
    found = answer.status, answer.read()
    connection.close()
    return found


def test_the_page_holds_its_machines() -> None:
    assert page.PLACE in (Path(__file__).parents[2] / "web" / "index.html").read_text()


def test_machines_are_put_into_the_page(template: Path) -> None:
    assert template.exists()
    text = page.page_with({"ball": machine_data(BALL)}, "ball")
    found = re.search(r'id="machines">(.*)</script>', text)
    assert found
    assert json.loads(gzip.decompress(base64.b64decode(found[1])))["chosen"] == "ball"
    assert 'id="server"' not in text


def test_without_the_page_the_command_says_how_to_build_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr(page, "PAGE", tmp_path / "none.html")
    assert cli.main(["explore", "bouncing-ball"]) == cli.FAILED
    assert "make explorer" in capsys.readouterr().err


def test_the_server_answers_this_computer_alone(server: page.Server) -> None:
    assert server.server_address[0] == "127.0.0.1"
    assert asked(server, "/") == (200, b"the page")
    assert asked(server, "/", host="example.org:80")[0] == 403
    assert asked(server, "/../etc/passwd")[0] == 404
    assert asked(server, "/machine/none")[0] == 404


def test_the_server_compiles_what_the_page_was_not_given(server: page.Server) -> None:
    values = {**values_of(BALL), "restitution": 0.0}
    question = {"machine": "ball", "values": values, "start": {"x": [2.0], "v": [0.0], "phase": 0}}
    status, answer = asked(server, "/recording", json.dumps(question))
    assert status == 200
    assert json.loads(answer)["recording"]["inputs"] == [*values]
    question["start"] = {"x": [-99.0], "v": [0.0], "phase": 0}
    assert "behind" in json.loads(asked(server, "/recording", json.dumps(question))[1])["refused"]
    assert "refused" in json.loads(asked(server, "/recording", "{}")[1])


def test_a_slider_knows_what_its_parameter_takes() -> None:
    damper = vi.machines.ImpactDamper(**vi.machines.ImpactDamper.example)
    allowed = {one["name"]: one["check"] for one in machine_data(damper)["parameters"]}
    assert allowed["restitution"] == "fraction"
    assert allowed["zeta"] == "nonnegative"
    assert allowed["omega"] == "positive"
