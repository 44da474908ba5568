"""House rules that no compiler checks: who may use whom, how long files may be, where `unsafe` is."""

from __future__ import annotations

import re
import statistics
import tomllib
from pathlib import Path

import pytest
from support.shared import REPO

CRATES = REPO / "crates"

# Which crates of ours each crate may use; everything not listed is a forbidden arrow. Lowest first.
ALLOWED: dict[str, set[str]] = {
    "tyndall-math": set(),
    "tyndall-vdb": set(),  # publishable alone
    "tyndall-scene": {"tyndall-math", "tyndall-vdb"},
    "tyndall-io": {"tyndall-math", "tyndall-vdb", "tyndall-scene"},
    "tyndall-geometry": {"tyndall-math", "tyndall-scene"},
    "tyndall-shading": {"tyndall-math", "tyndall-scene"},
    "tyndall-volume": {"tyndall-math"},  # does not know guiding
    "tyndall-guiding": {"tyndall-math"},  # sees no geometry, materials or scene
    "tyndall-render": {  # opens no file: no tyndall-io
        "tyndall-math",
        "tyndall-vdb",
        "tyndall-scene",
        "tyndall-geometry",
        "tyndall-shading",
        "tyndall-volume",
        "tyndall-guiding",
    },
    "tyndall-py": {
        "tyndall-math",
        "tyndall-vdb",
        "tyndall-scene",
        "tyndall-io",
        "tyndall-guiding",
        "tyndall-render",
    },
}
SECTIONS = ("dependencies", "dev-dependencies", "build-dependencies")
# The wide ray kernel argues each use in a SAFETY comment.
UNSAFE_ALLOWED = "crates/tyndall-geometry/src/bvh"
MOST_LINES, MEDIAN_LINES = 700, 200
SKIPPED_FOLDERS = {".git", ".venv", "target", "out", "dist", "build", "__pycache__", "node_modules"}


def manifests() -> list[Path]:
    return sorted(CRATES.glob("*/Cargo.toml"))


def our_dependencies(manifest: dict[str, object]) -> set[str]:
    """Return the crates of ours a manifest names, in any section, for any target."""
    tables = [manifest, *dict(manifest.get("target", {})).values()]
    names = {name for table in tables for section in SECTIONS for name in table.get(section, {})}
    return {name for name in names if name.startswith("tyndall-")}


def sources(*suffixes: str) -> list[Path]:
    """Return the source files of the repository."""
    found = []
    for path in REPO.rglob("*"):
        parts = path.relative_to(REPO).parts
        if path.suffix in suffixes and path.is_file() and not SKIPPED_FOLDERS.intersection(parts):
            found.append(path)
    assert found, f"no {suffixes} files below {REPO}"
    return sorted(found)


def test_every_crate_has_its_place() -> None:
    names = {tomllib.loads(path.read_text())["package"]["name"] for path in manifests()}
    assert names == set(ALLOWED), "a new crate needs its line in ALLOWED (and in ARCHITECTURE.md)"


@pytest.mark.parametrize("path", manifests(), ids=lambda path: path.parent.name)
def test_crates_use_only_what_is_below_them(path: Path) -> None:
    manifest = tomllib.loads(path.read_text())
    name = manifest["package"]["name"]
    forbidden = our_dependencies(manifest) - ALLOWED[name]
    assert not forbidden, f"{name} must not use {', '.join(sorted(forbidden))}"


def test_allowed_arrows_point_downward() -> None:
    order = list(ALLOWED)
    for name, uses in ALLOWED.items():
        assert all(order.index(used) < order.index(name) for used in uses), name


@pytest.mark.parametrize("path", manifests(), ids=lambda path: path.parent.name)
def test_crates_take_the_workspace_lints(path: Path) -> None:
    assert tomllib.loads(path.read_text()).get("lints") == {"workspace": True}


def test_the_usd_front_end_is_translation_only() -> None:
    """The core package knows neither USD nor its front ends."""
    package = CRATES / "tyndall-py" / "python"
    imports = re.compile(r"^\s*(?:from|import)\s+(pxr|tyndall_usd|bpy)\b", re.MULTILINE)
    for path in package.rglob("*.py"):
        assert not imports.search(path.read_text(encoding="utf-8")), path


def test_files_stay_readable() -> None:
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in sources(".rs", ".py")}
    long = {str(path.relative_to(REPO)): n for path, n in lengths.items() if n > MOST_LINES}
    assert not long, f"over {MOST_LINES} lines: {long}"
    assert statistics.median(lengths.values()) <= MEDIAN_LINES


def test_unsafe_is_in_one_place() -> None:
    comment_or_string = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\])*"', re.DOTALL)
    for path in sources(".rs"):
        code = comment_or_string.sub("", path.read_text(encoding="utf-8"))
        if re.search(r"\bunsafe\b", code):
            relative = path.relative_to(REPO).as_posix()
            assert relative.startswith(UNSAFE_ALLOWED), f"{relative} uses unsafe"


def test_no_paths_of_one_machine() -> None:
    # A bare folder of the root user may be a prim path; what lies in that user's home begins with a dot.
    folders = "|".join(("work/", "home/", "farm/", "Users/", r"root/\."))
    pattern = re.compile(rf"(?:^|[^A-Za-z0-9_.])/(?:{folders})")
    kinds = (".rs", ".py", ".pyi", ".toml", ".md", ".usda", ".json", ".txt", ".ini", ".sh", ".yml")
    files = [*sources(*kinds), *(REPO / "scripts").glob("*"), REPO / "Makefile", REPO / ".ci" / "run"]
    for path in filter(Path.is_file, files):
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            assert not pattern.search(line), f"{path.relative_to(REPO)}:{number}: {line.strip()}"
