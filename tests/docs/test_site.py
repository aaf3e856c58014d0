"""The whole site: it builds without a warning, and asks for nothing from elsewhere."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

for package in ("mkdocs", "material", "latex2mathml"):
    pytest.importorskip(package, reason="the site needs rig[docs]")
ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("site")
    build = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", target],
        cwd=ROOT,
        capture_output=True,
        text=True,
        # the theme's advertisement of its successor
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
    )
    assert build.returncode == 0, build.stdout + build.stderr
    assert "WARNING" not in build.stderr
    return target


def test_every_page_is_in_the_site(site: Path) -> None:
    written = {path.relative_to(ROOT / "docs") for path in (ROOT / "docs").rglob("*.md")}
    pages = {page.with_suffix(".html") for page in written if not page.name.endswith(".in.md")}
    pages |= {Path("reference/commands.html"), Path("bench/wiring.html"), Path("changelog.html")}
    assert [page for page in pages if not (site / page).is_file()] == []


def test_pages_load_nothing_from_elsewhere(site: Path) -> None:
    loaded = re.compile(r"""<(?:script|img|iframe)[^>]+src="?https?:|<link[^>]+href="?https?:""")
    pages = list(site.rglob("*.html"))
    assert pages
    assert [page for page in pages if loaded.search(page.read_text("utf-8"))] == []


def test_equations_are_drawn_by_the_browser_itself(site: Path) -> None:
    page = (site / "theory/beam.html").read_text("utf-8")
    assert page.count("<math") > 5
    assert "```math" not in page
