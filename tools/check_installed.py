"""Check an installed package, without a compiler: the first figure, and the same bits from every instruction set.

python tools/check_installed.py            # of this Python
python tools/check_installed.py --whole    # a wheel for others: every instruction set, and the explorer's page
"""

from __future__ import annotations

import argparse
import hashlib
import os
import platform
import subprocess
import sys
import tempfile
import time
from importlib.resources import files
from pathlib import Path

LONGEST = 60.0  # seconds to the first figure, with the imports
BUILDS = {"x86_64": {"avx512", "avx2", "baseline"}}  # of CMakeLists.txt; other processors have one


def impacts() -> str:
    """Digest of a thousand impacts of a motion that is not periodic."""
    import vibroimpact as vi

    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=0.95
    )
    run = vi.simulate(damper, damper.free_start(), impacts=1000)
    return hashlib.sha256(run.time.tobytes() + run.velocity_after.tobytes()).hexdigest()


def figure(folder: Path) -> None:
    """Draw the first figure of the README."""
    import vibroimpact as vi
    from vibroimpact.plotting import save

    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.0
    )
    orbit = vi.symmetric_orbits(damper)[0]
    save(
        vi.section(damper, orbit.state.perturbed(1e-3), settle_events=20_000).plot(),
        folder / "circle.svg",
    )
    assert (folder / "circle.svg").stat().st_size > 0


def main(*, whole: bool) -> None:
    """Check what is installed, and say what there is."""
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        figure(Path(folder))
    taken = time.monotonic() - begin
    print(f"first figure after {taken:.1f} s")
    assert taken < LONGEST

    from vibroimpact import _cpu, _kernel

    names = {file.name.partition(".")[0] for file in files("vibroimpact").iterdir()}
    built = {name.removeprefix("_kernel_") for name in names if name.startswith("_kernel_")}
    usable = [name for name in _cpu.supported() if name in built]
    found = {
        name: subprocess.run(
            [sys.executable, __file__, "--impacts"], check=True, capture_output=True, text=True,
            env=os.environ | {"VIBROIMPACT_TARGET": name},
        ).stdout
        for name in usable
    }  # fmt: skip
    print(
        f"built for {', '.join(sorted(built))}; runs {', '.join(usable)}; chosen {_kernel.target}"
    )
    assert len(set(found.values())) == 1, found
    if whole:
        wanted = BUILDS.get(platform.machine(), {"baseline"})
        assert built == wanted, f"built for {built}, not for {wanted}"
        assert files("vibroimpact").joinpath("explorer/page.html").is_file(), (
            "no page: make explorer"
        )
        print("the explorer's page is there")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--whole", action="store_true", help="of a wheel for others")
    parser.add_argument("--impacts", action="store_true", help="print the digest of a motion alone")
    arguments = parser.parse_args()
    if arguments.impacts:
        print(impacts())
    else:
        main(whole=arguments.whole)
