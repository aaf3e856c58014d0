"""An actuator as an input deck (`.inp`) of Abaqus or CalculiX: mm, N, MPa, tonne, s.

The same mesh, sets, material, rigid cap if any, and loads as the finite element model it is of:
first its weight, then the pressure of the cavity, which follows the deformed surface because the
steps are geometrically nonlinear. Keywords after the Abaqus Keywords Guide and CalculiX CrunchiX
User's Manual 2.20. The two part in the elements' names, and where CalculiX gives a rigid body's
rotation a node of its own.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.deck.elements import Elements, Program, elements_of, faces_of
from rig.mechanics.deck.errors import DeckError
from rig.mechanics.deck.material import material_law
from rig.mechanics.fe import Discretisation, Kinematics, Model, RigidBody, Solid
from rig.mechanics.fe.rigid import MOTIONS
from rig.mechanics.fe.sliding import Sliding

Indices = NDArray[np.int64]

_MM = 1e3
_TONNE_PER_MM3 = 1e-12
_MEGAPASCAL = 1e6
_PER_LINE = 16
"""Entries of a data line at most, in both programs."""
_REPORTED = "REPORTED"
_AXES = {
    Kinematics.SOLID: "x along the axis; y = 0 is a plane of symmetry.",
    Kinematics.AXISYMMETRIC: "x along the radius, y along the axis of revolution.",
}
_SOLIDS = ("SOFT", "LAYER")
"""Element sets of a model's solids, in their order."""


@runtime_checkable
class DeckModel(Protocol):
    """What a deck is made from."""

    @property
    def model(self) -> Model:
        """Solids, a rigid cap or none, and the cavity; boundaries `clamped` and `cap` or `top`."""
        ...

    @property
    def planes(self) -> Mapping[str, int]:
        """Boundaries on planes or the axis of symmetry, to the component of displacement that
        they hold."""
        ...

    @property
    def density(self) -> float:
        """In kg/m3."""
        ...

    @property
    def acceleration(self) -> tuple[float, float, float]:
        """Gravity in m/s2."""
        ...


def modelled_part(actuator: DeckModel) -> str:
    """What symmetry leaves of the actuator, in words."""
    if actuator.model.discretisation.kinematics is Kinematics.AXISYMMETRIC:
        return "the meridian"
    return {1: "half", 2: "a quarter"}[len(actuator.planes)]


def write_deck(
    path: Path,
    actuator: DeckModel,
    *,
    pressure: float,
    program: Program = Program.CALCULIX,
    increments: int = 10,
    title: str = "",
) -> None:
    """Write the deck for a cavity pressure in Pa reached in equal increments, as text.

    Raises DeckError where the material or the elements have no counterpart, or `path` cannot be
    written.
    """
    content = "\n".join(_lines(actuator, pressure, program, increments, title)) + "\n"
    try:
        path.write_text(content, encoding="ascii", errors="replace")
    except OSError as error:
        raise DeckError(
            f"{path} cannot be written: {error.strerror}. Choose another file."
        ) from error


def _lines(
    actuator: DeckModel, pressure: float, program: Program, increments: int, title: str
) -> Iterator[str]:
    d = actuator.model.discretisation
    elements = elements_of(d)
    cap = next(iter(actuator.model.bodies), None)
    used = np.unique(elements.nodes)
    reference, rotation = len(d.nodes) + 1, len(d.nodes) + 2
    calculix = program is Program.CALCULIX

    yield "*HEADING"
    yield f"{title or 'actuator'}: {modelled_part(actuator)} of it, by rig"
    yield "** Units: mm, N, MPa, tonne, s."
    yield f"** {_AXES[d.kinematics]}"
    if cap is not None:
        yield f"** Weight of the modelled part of the cap: {cap.weight[0]:.6g} N."
    yield "*NODE, NSET=ALL"
    for node in used:
        yield _row(node + 1, *(_MM * d.nodes[node]))
    reported = ["TOP"]
    if cap is not None:
        reported = ["CAP_REFERENCE", "CAP_ROTATION"] if calculix else ["CAP_REFERENCE"]
        for name, node in zip(reported, (reference, rotation), strict=False):
            yield f"*NODE, NSET={name}"
            yield _row(node, *(_MM * cap.centre))
    for name, solid in zip(_SOLIDS, actuator.model.solids, strict=False):
        yield f"*ELEMENT, TYPE={elements.type.names[program]}, ELSET={name}"
        for number in solid.elements:
            yield from _rows((number + 1, *(elements.nodes[number] + 1)), carry_on=True)

    cap_nodes = np.intersect1d(() if cap is None else cap.nodes, used)
    # the cap's own freedoms decide about its nodes on planes of symmetry
    supports = {
        "CLAMPED": (np.intersect1d(d.nodes_on("clamped"), used), (1, d.dim)),
        **{
            name.upper(): (
                np.setdiff1d(np.intersect1d(d.nodes_on(name), used), cap_nodes),
                (component + 1, component + 1),
            )
            for name, component in actuator.planes.items()
        },
    }
    end = {"TOP": np.intersect1d(d.nodes_on("top"), used)} if cap is None else {"CAP": cap_nodes}
    sets = {name: nodes for name, (nodes, _) in supports.items()} | end
    for name, nodes in sets.items():
        yield f"*NSET, NSET={name}"
        yield from _rows(nodes + 1)
    if calculix:
        # CalculiX cuts its increments as it likes; at these it stops and prints
        yield f"*TIME POINTS, NAME={_REPORTED}"
        times = [number / increments for number in range(1, increments + 1)]
        yield from (_row(*times[i : i + 8]) for i in range(0, increments, 8))
    faces = yield from _surface("CAVITY", d, elements, d.facets_on("cavity"))
    yield from _material(actuator)
    yield from _interfaces(actuator.model, elements, program)
    if cap is not None:
        yield _rigid(reference, rotation if calculix else None)
    yield "*BOUNDARY"
    if cap is not None:
        yield from _held(cap, reference, rotation if calculix else None)
    for name, (_, (first, last)) in supports.items():
        yield f"{name}, {first}, {last}"

    size = float(np.linalg.norm(actuator.acceleration))
    if size > 0:
        yield from _step(1)
        yield "*DLOAD"
        direction = [c / size for c in actuator.acceleration]
        pull = _row(_MM * size, *direction)
        for name in _SOLIDS[: len(actuator.model.solids)]:
            yield f"{name}, GRAV, {pull}"
        yield "*CLOAD"
        for component, force in enumerate(() if cap is None else cap.weight, start=1):
            if force:
                yield f"{reference}, {component}, {force:.9g}"
        yield from _output(reported, calculix)
    yield from _step(increments)
    yield "*DLOAD"
    for face in faces:
        yield f"CAVITY_{face}, P{face}, {pressure / _MEGAPASCAL:.9g}"
    yield from _output(reported, calculix)


def _surface(
    name: str, d: Discretisation, elements: Elements, facets: Indices
) -> Generator[str, None, list[int]]:
    """Facets as element sets by face and as a surface; returns the faces there are."""
    owners = faces_of(elements, d.mesh, facets)
    faces = [int(face) + 1 for face in np.unique(owners[:, 1])]
    for face in faces:
        yield f"*ELSET, ELSET={name}_{face}"
        yield from _rows(np.sort(owners[owners[:, 1] == face - 1, 0]) + 1)
    yield f"*SURFACE, NAME={name}, TYPE=ELEMENT"
    for face in faces:
        yield f"{name}_{face}, S{face}"
    return faces


def _interfaces(model: Model, elements: Elements, program: Program) -> Iterator[str]:
    """Parts that slide on each other, as contact pairs of the same stiffness and friction.

    Either program has its own law of how friction sets in and follows sliding of any size.
    """
    for number, interface in enumerate(model.interfaces, start=1):
        if not isinstance(interface, Sliding):
            raise DeckError(f"{type(interface).__name__} has no counterpart in a deck.")
        slave, master, law = (f"{name}_{number}" for name in ("SLAVE", "MASTER", "SLIDING"))
        yield from _surface(slave, model.discretisation, elements, interface.slave)
        yield from _surface(master, model.discretisation, elements, interface.master)
        stiffness = interface.penalty / _MEGAPASCAL / _MM
        yield f"*SURFACE INTERACTION, NAME={law}"
        yield "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"
        yield f"{stiffness:.9g}"
        if interface.friction:
            yield "*FRICTION"
            stick = f", {stiffness / 10:.9g}" if program is Program.CALCULIX else ""
            yield f"{interface.friction:.9g}{stick}"
        yield f"*CONTACT PAIR, INTERACTION={law}, TYPE=SURFACE TO SURFACE"
        yield f"{slave}, {master}"


def _material(actuator: DeckModel) -> Iterator[str]:
    for name, solid in zip(_SOLIDS, actuator.model.solids, strict=False):
        yield from _section(name, solid, actuator.density)


def _section(name: str, solid: Solid, density: float) -> Iterator[str]:
    law = material_law(solid.distortion, solid.volume)
    yield f"*SOLID SECTION, ELSET={name}, MATERIAL={name}_MATERIAL"
    yield ""
    yield f"*MATERIAL, NAME={name}_MATERIAL"
    if law.remark:
        yield f"** {law.remark}"
    for keyword, lines in law.keywords:
        yield f"*{keyword}"
        yield from (_row(*line) for line in lines)
    yield "*DENSITY"
    yield f"{density * _TONNE_PER_MM3:.9g}"


def _rigid(reference: int, rotation: int | None) -> str:
    if rotation is None:
        return f"*RIGID BODY, REF NODE={reference}, TIE NSET=CAP"
    return f"*RIGID BODY, NSET=CAP, REF NODE={reference}, ROT NODE={rotation}"


def _held(cap: RigidBody, reference: int, rotation: int | None) -> Iterator[str]:
    """The motions that the rigid cap may not do."""
    for number, motion in enumerate(MOTIONS, start=1):
        if motion in cap.free:
            continue
        if number > 3 and rotation is not None:
            yield f"{rotation}, {number - 3}, {number - 3}"
        else:
            yield f"{reference}, {number}, {number}"


def _step(increments: int) -> Iterator[str]:
    yield "*STEP, NLGEOM=YES, INC=1000"
    yield "*STATIC"
    yield f"{1 / increments:.9g}, 1, 1e-6, {1 / increments:.9g}"


def _output(reported: Iterable[str], at_time_points: bool) -> Iterator[str]:
    when = f", TIME POINTS={_REPORTED}" if at_time_points else ""
    for name in reported:
        yield f"*NODE PRINT, NSET={name}{when}"
        yield "U"
    yield f"*NODE FILE{when}"
    yield "U"
    yield f"*EL FILE{when}"
    yield "S, E"
    yield "*END STEP"


def _row(*values: float) -> str:
    return ", ".join(f"{value:.12g}" for value in values)


def _rows(numbers: Iterable[int], *, carry_on: bool = False) -> Iterator[str]:
    """Integers, as many to a line as programs read; a comma at the end carries a record on."""
    every = [str(int(number)) for number in numbers]
    for start in range(0, len(every), _PER_LINE):
        line = ", ".join(every[start : start + _PER_LINE])
        yield line + ("," if carry_on and start + _PER_LINE < len(every) else "")
