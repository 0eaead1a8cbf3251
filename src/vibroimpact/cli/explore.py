"""Command vibroimpact explore: machines in the browser, moving, with their parameters as sliders."""

from __future__ import annotations

import argparse
import sys
import webbrowser
from contextlib import suppress

from vibroimpact._core.docstrings import head_of
from vibroimpact.cli import common
from vibroimpact.cli.output import Done
from vibroimpact.explorer.page import Server, check_built, page_with
from vibroimpact.explorer.page_data import catalogue, machine_data
from vibroimpact.machines.registry import DEFAULT
from vibroimpact.results.files import PAGES

EXAMPLE = "  vibroimpact explore impact-damper/A --omega 1.0"
FIRST = "impact-damper/2a"  # where nothing else is named


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_system(parser)
    parser.add_argument(
        "--port", type=int, default=0,
        help="port on this computer at which the page is served (default: one that is free)",
    )  # fmt: skip
    parser.add_argument(
        "--no-browser", action="store_true", help="print the address and open no browser"
    )
    common.add_out(parser, (), PAGES, ())


def run(arguments: argparse.Namespace) -> Done:
    """Write the page, or serve it until Ctrl-C."""
    check_built()
    if arguments.machine == DEFAULT and not (arguments.case or arguments.config):
        arguments.case = FIRST
    case = common.case_of(arguments)
    data = machine_data(case.system, case.start)
    name, machines = data["name"], catalogue()
    if arguments.out:
        every = {one: machine_data(m) for one, m in machines.items() if one != name}
        return Done(
            ["a page with every machine of the catalogue, which works from a folder"],
            page=lambda: page_with({name: data, **every}, name),
        )
    others = {one: head_of(type(m)) for one, m in machines.items() if one != name}
    page = page_with({name: data}, name, others)
    with Server(page, {**machines, name: case.system}, arguments.port) as server:
        sys.stdout.write(f"the explorer is at {server.address}\nCtrl-C ends it\n")
        sys.stdout.flush()
        if not arguments.no_browser:
            webbrowser.open(server.address)
        with suppress(KeyboardInterrupt):
            server.serve_forever()
    return Done(["ended"])
