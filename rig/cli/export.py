"""`rig export`: the actuator's parts as files for printing and for CAD."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rig.cli.app import app


@app.command()
def export(
    actuator: Annotated[
        Path, typer.Option(help="actuator spec, as models/actuators/bellow-bending.yaml")
    ],
    stl: Annotated[
        Path | None,
        typer.Option(
            help="soft part as STL; rigid parts beside it, as FILE-connector.stl, FILE-cap.stl"
        ),
    ] = None,
    step: Annotated[
        Path | None, typer.Option(help="all parts as one STEP file with exact surfaces")
    ] = None,
    tolerance: Annotated[
        str, typer.Option(help="furthest that STL chords leave round surfaces")
    ] = "0.01 mm",
) -> None:
    """Write the actuator's geometry: watertight STL for printing, STEP for CAD. All in mm.

    The soft part has its air inlet. Needs the CAD libraries: `pip install 'rig[cad]'`.

    Example: `rig export --actuator models/actuators/bellow-bending.yaml --stl bellow.stl`
    """
    from rig.mechanics.cad.parts import parts_of
    from rig.spec.loading import load_actuator

    if stl is None and step is None:
        raise typer.BadParameter("nothing to write: give --stl FILE, --step FILE or both.")
    spec = load_actuator(actuator)
    parts = parts_of(spec.geometry)
    if stl is not None:
        from rig.mechanics.cad.facets import triangulate
        from rig.mechanics.cad.stl import volume, write_stl

        chord = _tolerance(tolerance)
        surfaces = [triangulate(part.solid, chord) for part in parts]
        for part, surface in zip(parts, surfaces, strict=True):
            path = stl if part.is_soft else stl.with_stem(f"{stl.stem}-{part.name}")
            count = write_stl(path, surface)
            typer.echo(f"{path}: {part.name}, {count} triangles, {volume(surface) * 1e6:.3f} mL")
    if step is not None:
        from rig.mechanics.cad.brep import write_step

        write_step(step, parts)
        typer.echo(f"{step}: {', '.join(part.name for part in parts)}")


def _tolerance(text: str) -> float:
    from rig.spec.quantity import to_si

    bare = not text.lstrip("+-.0123456789eE").strip()
    try:
        value = float(to_si(f"{text} mm" if bare else text, "m"))
    except ValueError as error:
        raise typer.BadParameter(f"{error}; --tolerance wants a length, as '0.01 mm'.") from None
    if not 1e-7 <= value <= 1e-3:
        raise typer.BadParameter(
            f"--tolerance {text} is out of range: between 0.0001 mm (huge files) and 1 mm."
        )
    return value
