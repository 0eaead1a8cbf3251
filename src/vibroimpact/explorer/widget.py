"""The explorer as a widget of a notebook: the page's machine, parameters and start are read and written in Python.

Method      The state of the page is its permalink (link.py), a trait of the widget: where the page's changes, Python
            reads it, and what Python writes the page takes as it takes a link. The page itself is asked for by a
            message, so that a saved notebook does not hold it; so are compilations at values that it was not given.
            It is shown by embed.js, as in any other page.
Fails       values that the machine refuses: the page says why, and Python keeps those before
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from vibroimpact._core.checks import check_count, refusal
from vibroimpact._core.errors import BackendUnavailableError, VibroImpactError
from vibroimpact.compile.hybrid import compile_mechanism
from vibroimpact.explorer.link import link_of, read_link
from vibroimpact.explorer.page import answer_of, check_built, page_with
from vibroimpact.explorer.page_data import json_text, machine_data, start_of
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.simulation.simulate import begin

LOWEST, HIGHEST = 200, 10_000  # pixels


class Explorer:
    """A machine that moves in a notebook, with sliders, a section, diagrams and planes: the page of ``explore``.

    Put it last in a cell. What is changed on the page is read from :attr:`system` and :attr:`start`; the page takes
    what is assigned to them.

    Parameters
    ----------
    system
        A machine, or a mechanism.
    start
        Where its motion begins; by default the start of the machine, of a mechanism all zero.
    height
        Of the page, in pixels, 200 to 10000.

    Attributes
    ----------
    widget
        The widget of anywidget that a notebook shows, for layouts; its trait ``link`` is the page's permalink.

    Raises
    ------
    InvalidParameterError
        No system, a start of another size.
    BackendUnavailableError
        anywidget is not installed: the extra ``notebook``.
    VibroImpactError
        The page is not part of the installation: ``make explorer``.

    Notes
    -----
    Takes a second or so, in which the machine's compile step is written down for the page. The page computes in the
    browser, with the same bits as Python. A notebook that is opened without Python shows an empty frame.
    """

    def __init__(self, system: System, start: State | None = None, *, height: int = 900) -> None:
        mechanism_of(system)
        check_count("height", height, LOWEST, HIGHEST)
        start = start_of(system) if start is None else start
        check_start(system, start)
        check_built()
        kind = _kind()
        self._data, self._recorded = machine_data(system, start), system
        self._system, self._start = system, start
        self._told = list[Callable[[Explorer], object]]()
        self.widget: Any = kind(link=link_of(system, start), height=height)
        self.widget.on_msg(lambda _, content, *__: self._answer(content))
        self.widget.observe(self._hear, "link")

    @property
    def system(self) -> System:
        """The machine, with the parameters that the page has."""
        return self._system

    @system.setter
    def system(self, system: System) -> None:
        alike = mechanism_of(system).degrees == mechanism_of(self._system).degrees
        start = self._start if alike else start_of(system)
        check_start(system, start)
        self._show(system, start)

    @property
    def start(self) -> State:
        """Where the motion on the page begins."""
        return self._start

    @start.setter
    def start(self, start: State) -> None:
        check_start(self._system, start)
        self._show(self._system, start)

    def observe(self, function: Callable[[Explorer], object]) -> None:
        """Call a function whenever the page has another machine or start.

        Parameters
        ----------
        function
            Called as ``function(explorer)``.
        """
        if not callable(function):
            raise refusal("function", function, "a function of the explorer")
        self._told.append(function)

    def _repr_mimebundle_(self, **options: Any) -> Any:
        return self.widget._repr_mimebundle_(**options)

    def _show(self, system: System, start: State) -> None:
        """Let the page have another start or other values; with another machine it begins again."""
        is_another = not self._is_ours(system)
        if is_another:
            self._data, self._recorded = machine_data(system, start), system
        self._system, self._start = system, start
        if is_another:
            self._send_page()
        self.widget.link = link_of(system, start)

    def _is_ours(self, system: System) -> bool:
        """Whether this is the page's machine, at whatever values."""
        try:
            same, _ = read_link(link_of(system, self._start), self._recorded, self._start)
        except VibroImpactError:
            return False
        return same == system

    def _hear(self, _: object) -> None:
        """Take what the page has now."""
        try:
            system, start = read_link(self.widget.link, self._recorded, self._start)
            check_start(system, start)
        except VibroImpactError:
            return  # the page says why
        if (system, start) == (self._system, self._start):
            return
        self._system, self._start = system, start
        for function in self._told:
            function(self)

    def _answer(self, content: Any) -> None:
        """Send what the page asks for: itself, or a compilation at the values that it has now."""
        if "question" not in content:
            self._send_page()
            return
        answer = answer_of({self._data["name"]: self._recorded}, content["question"])
        self.widget.send({"question": content["question"]}, [json_text(answer).encode()])

    def _send_page(self) -> None:
        """Send the page, at the present machine and start."""
        page = page_with({self._data["name"]: self._data}, self._data["name"])
        link = link_of(self._system, self._start)
        self.widget.send({"link": link}, [page.encode()])


def check_start(system: System, start: State) -> None:
    """Refuse what is no state of a system, or lies behind a stop."""
    begin(compile_mechanism(mechanism_of(system)), start)


@cache
def _kind() -> Any:
    """The class of the widget, where anywidget is installed."""
    try:
        from anywidget import AnyWidget
        from traitlets import Int, Unicode
    except ImportError:
        raise BackendUnavailableError(
            "Explorer: needs anywidget, which is not installed. Run: pip install 'vibroimpact[notebook]'."
        ) from None
    scripts = (Path(__file__).with_name(name) for name in ("embed.js", "widget.js"))
    text = "\n".join(script.read_text(encoding="utf-8") for script in scripts)
    traits = {"_esm": text, "link": Unicode().tag(sync=True), "height": Int().tag(sync=True)}
    return type("ExplorerWidget", (AnyWidget,), {"__module__": __name__, **traits})
