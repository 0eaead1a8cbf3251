"""What is installed and what is shipped: files, versions, dependencies, platforms."""

from __future__ import annotations

import re
import subprocess
import tarfile
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
import yaml

import vibroimpact as vi

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "src" / "vibroimpact"
PAGE = "src/vibroimpact/explorer/page.html"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
RECIPE = yaml.safe_load((ROOT / "recipe" / "recipe.yaml").read_text("utf-8"))
WORKFLOW = yaml.safe_load((ROOT / ".github" / "workflows" / "wheels.yml").read_text("utf-8"))


def tracked() -> set[str]:
    """Files of the clone."""
    try:
        done = subprocess.run(
            ["git", "ls-files"], cwd=ROOT, capture_output=True, check=True, text=True
        )
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a clone")
    return {name for name in done.stdout.splitlines() if (ROOT / name).exists()}


def names(requirements: list[str]) -> dict[str, str]:
    """Bounds of requirements by name."""
    found = (re.match(r"([\w-]+) ?(.*)", one) for one in requirements)
    return {one[1].replace("matplotlib-base", "matplotlib"): one[2] for one in found if one}


def test_the_installed_package_has_every_file_of_the_library_and_the_headers_and_no_other() -> None:
    files = metadata.files("vibroimpact") or []
    place = Path(vi.__file__).parents[1]
    if not any(Path(str(one.locate())) == Path(vi.__file__) for one in files):
        pytest.skip("an editable installation")
    held = {
        str(one)
        for one in files
        if "__pycache__" not in one.parts and ".dist-info" not in one.parts[0]
    }
    held = {one for one in held if not one.endswith("bin/vibroimpact")}
    kernels = {one for one in held if one.endswith(".so")}
    headers = {
        f"vibroimpact/include/{one.relative_to(ROOT / 'include')}"
        for one in ROOT.glob("include/**/*.hpp")
    }
    sources = {
        one.removeprefix("src/") for one in tracked() | {PAGE} if one.startswith("src/vibroimpact/")
    }
    sources = {one for one in sources if (ROOT / "src" / one).exists()}
    assert held - kernels == sources | headers
    assert {re.sub(r"\..*", "", Path(one).name) for one in kernels} >= {
        "_cpu",
        f"_kernel_{vi._kernel.target}",
    }
    assert place.joinpath("vibroimpact/py.typed").exists()


@pytest.mark.slow
def test_the_source_distribution_is_the_clone_with_the_page(tmp_path: Path) -> None:
    build = pytest.importorskip(
        "scikit_build_core.build", reason="scikit-build-core is not installed"
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        name = build.build_sdist(str(tmp_path))
    with tarfile.open(tmp_path / name) as archive:
        held = {one.name.partition("/")[2] for one in archive.getmembers() if one.isfile()}
    page = {PAGE} if (ROOT / PAGE).exists() else set()
    assert held - {"PKG-INFO"} == tracked() | page


def test_versions_and_dependencies_of_the_recipe_are_those_of_the_project() -> None:
    project = PROJECT["project"]
    assert RECIPE["context"]["version"] == project["version"]
    needs = RECIPE["requirements"]
    assert names(needs["run"]) == names(
        [f"python {project['requires-python']}", *project["dependencies"]]
    )
    assert names(PROJECT["build-system"]["requires"]).items() <= names(needs["host"]).items()
    cmake = PROJECT["tool"]["scikit-build"]["cmake"]["version"]
    assert f"cmake {cmake}" in needs["build"]


def test_wheels_are_built_for_every_python_and_platform_that_the_project_names() -> None:
    settings = PROJECT["tool"]["cibuildwheel"]
    least = PROJECT["project"]["requires-python"].removeprefix(">=3.")
    stable = PROJECT["tool"]["scikit-build"]["wheel"]["py-api"]  # serves all from this one on
    assert settings["build"] == [
        f"cp3{minor}-*" for minor in range(int(least), int(stable[3:]) + 1)
    ]
    platforms = {
        one["platform"] for one in WORKFLOW["jobs"]["wheels"]["strategy"]["matrix"]["include"]
    }
    assert platforms == {"linux-x86_64", "linux-aarch64", "macos-arm64", "macos-x86_64"}
    assert all(
        part["environment"]["VIBROIMPACT_TARGETS"] == "all"
        for part in (settings, settings["macos"])
    )
    script = settings["test-command"].split()[1].removeprefix("{project}/")
    assert (ROOT / script).exists()
    assert RECIPE["build"]["script"]["env"]["VIBROIMPACT_TARGETS"] == "all"


def test_the_check_of_a_wheel_wants_every_instruction_set_of_the_build() -> None:
    text = (ROOT / "CMakeLists.txt").read_text("utf-8")
    built = re.search(r"x86_64.*?set\(known (.*?)\)", text, re.DOTALL)
    wanted = re.search(
        r'"x86_64": \{(.*?)\}', (ROOT / "tools" / "check_installed.py").read_text("utf-8")
    )
    assert built
    assert wanted
    assert set(built[1].split()) == set(re.findall(r"\w+", wanted[1]))
