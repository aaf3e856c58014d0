"""What mkdocs asks while it builds: pages made from the code, equations as MathML.

MathML is drawn by the browser itself, so that the site needs nothing from elsewhere.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from sitegen.pages import generated_pages

MATH_FENCE = "math"


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Let ```math fences, which code hosts know too, become MathML; fill the nav's folders."""
    options = config.mdx_configs.setdefault("pymdownx.superfences", {})
    options.setdefault("custom_fences", []).append(
        {"name": MATH_FENCE, "class": MATH_FENCE, "format": equation}
    )
    config.nav = [_filled(entry, Path(config.docs_dir)) for entry in config.nav or []]
    return config


def _filled(entry: dict[str, Any], docs: Path) -> dict[str, Any]:
    """The entry; where it names a folder, that folder's pages, `index.md` before the others."""
    ((title, place),) = entry.items()
    if not isinstance(place, str) or not place.endswith("/"):
        return entry
    pages = sorted((docs / place).glob("*.md"), key=lambda page: (page.stem != "index", page.stem))
    return {title: [place + page.name for page in pages]}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages."""
    root = Path(config.config_file_path or ".").resolve().parent
    for place, content in generated_pages(root).items():
        files.append(File.generated(config, place, content=content))
    return files


def equation(source: str, *_: Any, **__: Any) -> str:
    """A displayed equation of LaTeX as MathML, a row for each line."""
    rows = (convert(line, display="block") for line in source.splitlines() if line.strip())
    return f'<div class="{MATH_FENCE}">{"".join(rows)}</div>'
