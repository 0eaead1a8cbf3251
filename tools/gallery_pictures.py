"""Run the examples at full size: their pictures, made small, go to docs/pictures for docs/index.md.

    python tools/gallery_pictures.py            # all of them, a minute or two
    python tools/gallery_pictures.py lyapunov_map

The tests run the ensembles among them with fewer members (SMALLER in tests/docs/test_examples.py); here
they run in full. Prints what each took, and ends with 1 where one is too slow or too large.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
PICTURES = ROOT / "docs" / "pictures"
WIDTH = 320  # pixels: beside a line of text
LARGEST = 40_000  # bytes
LONGEST = 30.0  # seconds of an example


def picture_of(name: str) -> Path:
    """Where the small picture of an example is kept."""
    return PICTURES / f"example_{name}.png"


def run(name: str, picture: Path) -> float:
    """Run an example as a reader does; the seconds that it took."""
    begin = time.perf_counter()
    example = EXAMPLES / f"{name}.py"
    subprocess.run([sys.executable, example, "--out", picture], check=True, capture_output=True)
    return time.perf_counter() - begin


def scale(picture: Path, small: Path) -> None:
    """Scale a picture down to ``WIDTH``, with a palette that keeps rare colours of legends."""
    with Image.open(picture) as image:
        size = WIDTH, round(image.height * WIDTH / image.width)
        scaled = image.convert("RGB").resize(size, Image.Resampling.LANCZOS)
    colours = scaled.quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    colours.save(small, optimize=True)


def main(names: list[str]) -> int:
    """Make the pictures of some examples, or of all."""
    beyond = []
    for name in names or sorted(path.stem for path in EXAMPLES.glob("*.py")):
        with tempfile.TemporaryDirectory() as folder:
            picture = Path(folder) / "picture.png"
            seconds = run(name, picture)
            scale(picture, picture_of(name))
        size = picture_of(name).stat().st_size
        print(f"{name}: {seconds:.1f} s, {size / 1000:.0f} kB")
        if seconds > LONGEST or size > LARGEST:
            beyond.append(name)
    if beyond:
        print(f"above {LONGEST:.0f} s or {LARGEST / 1000:.0f} kB: {', '.join(beyond)}")
    return 1 if beyond else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
