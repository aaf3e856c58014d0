"""`rig export`: the actuator's parts as files for printing and for CAD."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.mechanics.cad.construct import Part
    from rig.mechanics.deck.write import DeckModel
    from rig.spec.actuator import ActuatorSpec


class Program(StrEnum):
    """Which program an input deck is for."""

    CALCULIX = "calculix"
    ABAQUS = "abaqus"


class Elements(StrEnum):
    """What an input deck is made of."""

    HEXAHEDRA = "hexahedra"
    TETRAHEDRA = "tetrahedra"


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
    inp: Annotated[
        Path | None,
        typer.Option(help="finite element model as an input deck: mesh, material, cap, loads"),
    ] = None,
    mould: Annotated[
        Path | None,
        typer.Option(help="moulds of a cast actuator as STL, one file a piece: FILE-PIECE.stl"),
    ] = None,
    tolerance: Annotated[
        str, typer.Option(help="furthest that STL chords leave round surfaces")
    ] = "0.01 mm",
    program: Annotated[
        Program, typer.Option(help="which program shall read the deck")
    ] = Program.CALCULIX,
    elements: Annotated[
        Elements, typer.Option(help="of the deck; tetrahedra need netgen")
    ] = Elements.HEXAHEDRA,
    size: Annotated[
        str | None,
        typer.Option(help="of the deck's tetrahedra, as '3 mm'; default: twice the wall"),
    ] = None,
    pressure: Annotated[
        str | None,
        typer.Option(help="of the deck, as '10 kPa'; default: the actuator's limit"),
    ] = None,
) -> None:
    """Write the actuator's geometry: watertight STL for printing, STEP for CAD. All in mm.

    The soft part has its air inlet. Actuators of silicone have moulds. Needs the CAD libraries:
    `pip install 'rig[cad]'`.

    The input deck for CalculiX or Abaqus (mm, N, MPa) is the part that symmetry leaves,
    without the inlet, as `--model fe` computes it. CalculiX has no mixed tetrahedra: its own are
    several per cent too stiff at a Poisson's ratio of 0.49, its hexahedra are not.

    Examples: `rig export --actuator models/actuators/bellow-bending.yaml --stl bellow.stl`;
    `rig export --actuator models/actuators/multi-chamber-bending.yaml --mould block.stl`
    """
    from rig.spec.loading import load_actuator

    if stl is None and step is None and inp is None and mould is None:
        raise typer.BadParameter(
            "nothing to write: give --stl FILE, --step FILE, --mould FILE or --inp FILE."
        )
    spec = load_actuator(actuator)
    if mould is not None:
        from rig.mechanics.cad.moulds import moulds_of

        _write_stl(mould, moulds_of(spec.geometry), tolerance)
    if stl is not None or step is not None:
        _write_geometry(spec, stl, step, tolerance)
    if inp is not None:
        most = spec.limits.pressure if pressure is None else _quantity("--pressure", pressure, "Pa")
        model = _model(spec, actuator, elements, size)
        _write_deck(inp, spec, model, program, most)


def _model(spec: ActuatorSpec, path: Path, elements: Elements, size: str | None) -> DeckModel:
    from rig.mechanics.bellow import bending_geometry
    from rig.mechanics.deck.build import deck_model
    from rig.mechanics.mesh.bellow_tetrahedra import mesh_bending_bellow_tetrahedra
    from rig.mechanics.simulate.bending import bending_model_on
    from rig.spec.workspace import Workspace

    material = Workspace.find(path).material(spec.material)
    if elements is Elements.HEXAHEDRA:
        if size is not None:
            raise typer.BadParameter("--size is of tetrahedra; hexahedra follow the geometry.")
        return deck_model(spec, material)
    geometry = bending_geometry(spec, "A deck of tetrahedra")
    largest = None if size is None else _quantity("--size", size, "m")
    return bending_model_on(mesh_bending_bellow_tetrahedra(geometry, largest), material)


def _write_deck(
    path: Path, spec: ActuatorSpec, model: DeckModel, program: Program, pressure: float
) -> None:
    from rig.mechanics.deck import elements as deck
    from rig.mechanics.deck.write import modelled_part, write_deck

    chosen = deck.Program(program.value)
    write_deck(path, model, pressure=pressure, program=chosen, title=spec.name)
    d = model.model.discretisation
    typer.echo(
        f"{path}: {len(d.connectivity)} {deck.elements_of(d).type.names[chosen]} for {program}, "
        f"{modelled_part(model)} of the actuator, up to {pressure / 1e3:g} kPa; mm, N, MPa"
    )


def _write_geometry(
    spec: ActuatorSpec, stl: Path | None, step: Path | None, tolerance: str
) -> None:
    from rig.mechanics.cad.parts import parts_of

    parts = parts_of(spec.geometry)
    if stl is not None:
        _write_stl(stl, parts, tolerance)
    if step is not None:
        from rig.mechanics.cad.brep import write_step

        write_step(step, parts)
        typer.echo(f"{step}: {', '.join(part.name for part in parts)}")


def _write_stl(path: Path, parts: Sequence[Part], tolerance: str) -> None:
    """The soft part into the file, every other one beside it."""
    from rig.mechanics.cad.facets import triangulate
    from rig.mechanics.cad.stl import volume, write_stl

    chord = _tolerance(tolerance)
    surfaces = [triangulate(part.solid, chord) for part in parts]
    for part, surface in zip(parts, surfaces, strict=True):
        file = path if part.is_soft else path.with_stem(f"{path.stem}-{part.name}")
        count = write_stl(file, surface)
        typer.echo(f"{file}: {part.name}, {count} triangles, {volume(surface) * 1e6:.3f} mL")


def _quantity(option: str, text: str, si: str) -> float:
    from rig.spec.quantity import to_si

    try:
        value = float(to_si(text, si))
    except ValueError as error:
        raise typer.BadParameter(f"{option} {text}: {error}") from None
    if not 0 < value < float("inf"):
        raise typer.BadParameter(f"{option} {text} must be above zero.")
    return value


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
