"""Every generated page by its place in the site."""

from __future__ import annotations

from pathlib import Path

from .commands import commands_page
from .evidence import evidence_pages
from .pins import HEADER, read_pins, wiring_diagram, wiring_table
from .plots import curves, read_table
from .specs import spec_pages

AUYSAKUL = Path("docs/validation/auysakul2023.md")


def generated_pages(root: Path) -> dict[str, str | bytes]:
    """Place below `docs/` to its content, for the checkout `root`."""
    pins = read_pins(_text(root / HEADER))
    experiment = read_table(_text(root / AUYSAKUL), "Table 5")
    pages: dict[str, str | bytes] = {
        "changelog.md": _text(root / "CHANGELOG.md"),
        "reference/commands.md": commands_page(),
        "bench/wiring.md": _filled(
            root / "docs/bench/wiring.in.md",
            diagram=wiring_diagram(pins),
            table=wiring_table(pins),
        ),
        "images/auysakul2023.svg": curves(experiment, "pressure (kPa)", "displacement (mm)"),
    }
    pages |= evidence_pages(root)
    return pages | {f"reference/specs/{kind}.md": page for kind, page in spec_pages().items()}


def _filled(template: Path, **values: str) -> str:
    text = _text(template)
    for name, value in values.items():
        place = f"{{{{ {name} }}}}"
        if place not in text:
            raise ValueError(f"{template} has no place for {place}")
        text = text.replace(place, value)
    return text


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")
