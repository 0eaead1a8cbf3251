"""A motion that hits several contacts has one name, whoever says it."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
import xarray as xr

import vibroimpact as vi
from vibroimpact.attractors.matching import proportional
from vibroimpact.attractors.orbit_type import symbol_word
from vibroimpact.plotting import plot_plane
from vibroimpact.results.result import words_of_codes
from vibroimpact.sweeps.analyses.motion_codes import (
    categories,
    column_of,
    motions,
    symbols_of,
)

REST = vi.State((0.0, 0.0), (0.0, 0.0))


def pair(omega: float, gap: float, wall: float) -> vi.Mechanism:
    """Two coupled masses; the first has a stop at ``wall``, the second two."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 1.0]], damping=[[0.2, -0.05], [-0.05, 0.15]],
        stiffness=[[2.0, -0.5], [-0.5, 1.5]], forces=(vi.Harmonic(omega, (1.0, 0.3)),),
        elements=(
            vi.RigidStop((1.0, 0.0), upper=wall, restitution=0.6),
            vi.RigidStop((0.0, 1.0), lower=-gap, upper=0.6, restitution=0.7),
        ),
    )  # fmt: skip


PAIR = vi.Family(pair, omega=1.0, gap=0.5, wall=0.5)
POINTS = [  # omega, gap, wall; name
    (0.844, 0.821, 0.5, "2-3-0,2-2"),
    (1.088, 0.2, 0.5, "1-1-0,0-2"),
    (1.332, 0.821, 0.5, "1-1-0,1-1"),
    (1.82, 1.028, 0.5, "1-1-0"),
    (1.088, 0.5, 50.0, "1-1-1 (contact 1)"),
]


def counted(mechanism: vi.Mechanism, cycles: int) -> list[tuple[int, int]]:
    """Impacts at stops A and B of each contact in ``cycles`` periods of a settled motion."""
    period = 2.0 * np.pi / mechanism.omega
    run = vi.simulate(mechanism, REST, impacts=20_000, t_max=(300 + cycles) * period)
    late = (run.time > 300 * period) & (run.status == vi.Status.IMPACT)
    counts = Counter(zip(run.contact[late].tolist(), run.side[late].tolist(), strict=True))
    return [(counts[contact, 1], counts[contact, -1]) for contact in (0, 1)]


@pytest.mark.parametrize(("omega", "gap", "wall", "name"), POINTS)
def test_sweeps_classify_and_find_orbit_give_a_motion_one_name(
    omega: float, gap: float, wall: float, name: str
) -> None:
    mechanism = pair(omega, gap, wall)
    over = {"omega": [omega], "gap": [gap], "wall": [wall]}
    swept = vi.sweep(PAIR, over=over, start=REST, observe=["symbol", "impacts"], settle_periods=600,
                     progress=False).squeeze()  # fmt: skip
    pairs = counted(mechanism, int(swept.n))
    assert symbol_word(int(swept.n), pairs) == name
    assert swept.p.values.tolist() == [p for p, _ in pairs]
    assert swept.q.values.tolist() == [q for _, q in pairs]
    codes = motions(swept)
    assert words_of_codes(codes)[int(codes)].replace("_", " ") == name
    contact, stop = next((c, s) for c in (0, 1) for s in (0, 1) if pairs[c][s])
    attractor = vi.classify(mechanism, REST, at=vi.AtStop("AB"[stop], contact=contact))  # type: ignore[arg-type]
    assert attractor.symbol == name
    assert attractor.label.startswith(f"{name} periodic")
    assert vi.find_orbit(mechanism, attractor.section.last).symbol == name


def test_a_plane_parts_motions_that_hit_different_stops() -> None:
    """Both have two impacts per period at stops A and none at B, if contacts are not told apart."""
    over = {"omega": [0.844, 1.6], "gap": [1.028, 1.2]}
    plane = vi.plane(PAIR, over=over, start=REST, settle_periods=600, progress=False)
    assert plane.p.dims == ("omega", "gap", "contact")
    words = [one.words for one in categories(plane.motion)]
    assert "1-1-0,1-0" in words
    assert len(words) > 1
    legend = [text.get_text() for text in plot_plane(plane).get_legend().get_texts()]
    assert set(words) <= set(legend)
    plot_plane(plane, symbols=words)


def test_basins_of_several_contacts_are_named_by_all_of_them() -> None:
    over = {"x1": [-0.4, 0.0, 0.3], "v2": [-0.5, 0.5]}
    for contact, stop in ((0, "A"), (1, "B")):
        found = vi.basins(
            pair(1.088, 0.2, 0.5),
            at=vi.AtStop(stop, contact=contact),
            over=over,
            start=REST,
            progress=False,
        )  # type: ignore[arg-type]
        assert found.name.values.tolist() == ["1-1-0,0-2 a"]
    starts = vi.GridStarts(over, REST)
    for contact in (0, 1):
        met = vi.multistability(
            PAIR,
            at=vi.AtStop(contact=contact),
            over={"omega": [1.088, 1.332]},
            start=starts,
            settle_periods=600,
            progress=False,
        )
        assert met.attractors.values.tolist() == [1, 1]


def test_codes_of_many_contacts_are_in_the_order_of_their_symbols() -> None:
    """17 numbers of up to 4095 do not fit into one of 64 bits."""
    generator = np.random.default_rng(5)
    table = generator.integers(0, 4096, (40, 17))[generator.integers(0, 40, 400)]
    n, p, q = table[:, 0], table[:, 1:9], table[:, 9:]
    meanings = {"flag_values": np.arange(1, dtype=np.int8), "flag_meanings": "time_reached"}
    given = xr.Dataset({
        "n": ("start", n), "p": (("start", "contact"), p), "q": (("start", "contact"), q),
        "end": ("start", np.zeros(400, dtype=np.int8), meanings),
        **{name: ("start", np.ones(400)) for name in ("impacts_a", "impacts_b")},
    })  # fmt: skip
    codes, words = motions(given), words_of_codes(motions(given))
    expected = [symbol_word(int(n[i]), list(zip(p[i], q[i], strict=True))) for i in range(400)]
    assert [words[int(code)] for code in codes] == expected
    frequency = Counter(expected)
    places = sorted(frequency, key=lambda word: (-frequency[word], [*map(int, word_numbers(word))]))
    assert [words[i] for i in range(len(places))] == places


def word_numbers(word: str) -> list[str]:
    """n, all p, all q of a word that names every contact."""
    n, *rest = word.replace(",", "-").split("-")
    return [n, *rest[::2], *rest[1::2]]


def test_symbols_are_proportional_only_if_those_of_every_contact_are() -> None:
    one = np.array([1, 1, 0, 0, 2])
    others = np.array([[2, 2, 0, 0, 4], [2, 2, 0, 4, 0], [1, 1, 0, 2, 2], [0, 0, 0, 0, 0]])
    assert proportional(others, one).tolist() == [True, False, False, True]
    assert proportional(others, 0 * one).all()


def test_a_word_names_contacts_unless_they_are_the_first() -> None:
    assert symbol_word(1, [(1, 1)]) == "1-1-1"
    assert symbol_word(0, [(0, 1), (2, 0)]) == "0-1,2-0"
    assert symbol_word(3, [(1, 0), (0, 0), (2, 0)]) == "3-1-0,2-0 (contact 0, 2)"


def test_the_impacts_at_a_stop_are_where_column_of_says() -> None:
    ends = ("start", np.zeros(2, dtype=np.int8))
    p, q = np.array([[11, 12, 13], [21, 22, 23]]), np.array([[14, 15, 16], [24, 25, 26]])
    several = xr.Dataset({
        "end": ends, "n": ("start", [1, 2]),
        "p": (("contact", "start"), p.T), "q": (("start", "contact"), q),
    })  # fmt: skip
    symbols = symbols_of(several)
    for contact in range(3):
        for stop, counts in (("A", p), ("B", q)):
            column = column_of(contact, stop, symbols.shape[-1])  # type: ignore[arg-type]
            assert symbols[:, column].tolist() == counts[:, contact].tolist()
    one = several.isel(contact=0)
    assert symbols_of(one).tolist() == [[1, 11, 14], [2, 21, 24]]
    assert column_of(0, "B", 3) == 2
