"""Design: parameters on the left; section, bending, curves and finite elements on the right."""

from __future__ import annotations

import html
from dataclasses import replace
from functools import partial
from typing import Any

from nicegui import events, ui

from rig.errors import RigError
from rig.mechanics.model import available_models
from rig.spec.material import MaterialSpec
from rig.studio.beside import Design, compared
from rig.studio.charts import moved, response_options
from rig.studio.curves import Beam, Curve
from rig.studio.design import (
    FAMILIES,
    LIMIT,
    Checked,
    Draft,
    blank,
    check,
    form_fields,
    open_draft,
    save,
)
from rig.studio.drawing import profile_svg, section_svg
from rig.studio.errors import StudioError
from rig.studio.pages.frame import frame, heading, number_of, say, telling, text_of
from rig.studio.pages.work import Progress
from rig.studio.properties import properties_of
from rig.studio.section import section_of
from rig.studio.state import Studio
from rig.studio.works import FINITE_ELEMENTS, FieldsAnswer, File, Format, export, finite_elements

FIRST = "bellow-bending"
SLIDER_STEPS = 200
FORMATS: tuple[Format, ...] = ("stl", "step", "inp")


def register(studio: Studio) -> None:
    """Serve the page."""

    @ui.page("/", title="Design - rig studio")
    def _page(actuator: str = "") -> None:
        with frame(studio, "Design"):
            DesignPage(studio, actuator)


class DesignPage:
    """One browser's draft."""

    def __init__(self, studio: Studio, actuator: str) -> None:
        self._studio = studio
        names = studio.workspace.names("actuator")
        self._draft = self._first(actuator, names)
        self._checked: Checked | None = None
        self._beam: Beam | None = None
        self._curve: Curve | None = None
        self._pinned: Design | None = None
        self._fields: Curve | None = None
        self._computed_of: Checked | None = None
        """The design that finite elements were asked for last."""
        self._inputs: dict[str, ui.input] = {}
        with ui.element("div").classes("two"):
            with ui.column().classes("panel"):
                self._form(names)
            with ui.column().classes("stack"):
                self._drawings()
                self._charts()
                self._finite_elements()
        self._show_form()

    def _first(self, wanted: str, names: list[str]) -> Draft:
        name = wanted if wanted in names else FIRST if FIRST in names else ""
        if name:
            try:
                return open_draft(self._studio.workspace, name)
            except RigError as error:
                say(str(error), "negative")
        materials = self._studio.workspace.names("material")
        return blank(FIRST, materials[0] if materials else "")

    # --- what is there ---------------------------------------------------------------------

    def _form(self, names: list[str]) -> None:
        heading("Actuator")
        if names:
            ui.select(names, label="open", with_input=True, on_change=self._open).props(
                "outlined dense"
            )
        for name, changed in (("name", self._renamed), ("description", self._described)):
            self._inputs[name] = ui.input(name, on_change=changed).props("outlined dense")
        self._family = ui.select(list(FAMILIES), label="family", on_change=self._new_family).props(
            "outlined dense"
        )
        self._material = ui.select(
            self._studio.workspace.names("material"), label="material", on_change=self._new_material
        ).props("outlined dense")
        self._properties = ui.html("", sanitize=False)
        heading("Parameters")
        self._parameters = ui.column().classes("stack")
        self._limit = self._input(LIMIT, "pressure limit", "the highest gauge pressure", "kPa")
        self._problems = ui.html("", sanitize=False).props('role="status" aria-live="polite"')
        with ui.row().classes("actions"):
            ui.button("Save", on_click=telling(self._save), color=None).classes("main").props(
                "unelevated"
            )
            self._replace = ui.checkbox("replace")
        with ui.row().classes("actions"):
            for kind in FORMATS:
                ui.button(
                    kind.upper(), on_click=telling(partial(self._export, kind)), color=None
                ).classes("plain").props(f'unelevated aria-label="export {kind.upper()}"')
        self._exporting = Progress(self._studio.workshop)

    def _drawings(self) -> None:
        with ui.element("div").classes("side-by-side"):
            with ui.column().classes("panel"):
                heading("Section at rest")
                self._section = ui.html("", sanitize=False)
            with ui.column().classes("panel"):
                heading("Bent by beam theory")
                self._bent = ui.html("", sanitize=False)
                self._slider = ui.slider(
                    min=0, max=SLIDER_STEPS, value=SLIDER_STEPS // 2, on_change=self._slid
                ).props('aria-label="pressure"')
                self._figures = ui.label().classes("figures said").props('role="status"')

    def _charts(self) -> None:
        with ui.column().classes("panel"):
            heading("Response")
            with ui.element("div").classes("side-by-side"):
                self._angle = ui.echart({}, renderer="svg").classes("chart")
                self._force = ui.echart({}, renderer="svg").classes("chart")
            with ui.row().classes("actions"):
                ui.button("Pin for comparison", on_click=telling(self._pin), color=None).classes(
                    "plain"
                ).props("unelevated")
                ui.button("Unpin", on_click=self._unpin, color=None).classes("plain").props(
                    "unelevated"
                )
            self._beside = ui.html("", sanitize=False).classes("scrolls")

    def _finite_elements(self) -> None:
        with ui.column().classes("panel"):
            heading("Finite elements")
            ui.label(
                "Angle, force, stress and strain up to the pressure limit, with safety factors "
                "and a view to turn. The first time takes minutes; results are kept."
            ).classes("muted")
            ui.button("Compute", on_click=telling(self._compute), color=None).classes("main").props(
                "unelevated"
            )
            self._computing = Progress(self._studio.workshop)
            self._stale = ui.html(
                '<p class="caution">The design has changed since: this is of the one before.</p>',
                sanitize=False,
            )
            self._stale.set_visibility(False)
            self._margin = ui.html("", sanitize=False)
            self._view = (
                ui.element("iframe")
                .classes("view")
                .props('title="finite elements: deformed view and safety factors"')
            )
            self._view.set_visibility(False)

    def _input(self, name: str, label: str, meaning: str, unit: str) -> ui.input:
        field = ui.input(
            f"{label} ({unit})" if unit else label, on_change=partial(self._typed, name)
        ).props("outlined dense debounce=80")
        field.tooltip(meaning)
        self._inputs[name] = field
        return field

    # --- what happens ----------------------------------------------------------------------

    def _open(self, event: events.ValueChangeEventArguments[Any]) -> None:
        try:
            self._draft = open_draft(self._studio.workspace, text_of(event.value))
        except RigError as error:
            say(str(error), "negative")
            return
        self._show_form()

    def _renamed(self, event: events.ValueChangeEventArguments[Any]) -> None:
        self._change(replace(self._draft, name=text_of(event.value)))

    def _described(self, event: events.ValueChangeEventArguments[Any]) -> None:
        self._change(replace(self._draft, description=text_of(event.value)))

    def _new_material(self, event: events.ValueChangeEventArguments[Any]) -> None:
        self._change(replace(self._draft, material=text_of(event.value)))

    def _new_family(self, event: events.ValueChangeEventArguments[Any]) -> None:
        family = text_of(event.value)
        if family in FAMILIES and family != self._draft.family:
            self._draft = self._draft.in_family(family)
            self._show_form()

    def _typed(self, name: str, event: events.ValueChangeEventArguments[Any]) -> None:
        self._change(self._draft.with_value(name, text_of(event.value)))

    def _change(self, draft: Draft) -> None:
        if draft != self._draft:
            self._draft = draft
            self._refresh()

    def _show_form(self) -> None:
        """Fill in the whole form from the draft."""
        draft = self._draft
        self._inputs = {n: i for n, i in self._inputs.items() if not n.startswith("geometry.")}
        self._parameters.clear()
        with self._parameters:
            for item in form_fields(draft.family):
                meaning = (
                    f"{item.meaning}: {', '.join(item.choices)}" if item.choices else item.meaning
                )
                self._input(item.name, item.label, meaning, item.unit)
        self._inputs["name"].value = draft.name
        self._inputs["description"].value = draft.description
        for name, text in draft.values.items():
            self._inputs[name].value = text
        self._family.value = draft.family
        materials = self._studio.workspace.names("material")
        self._material.value = draft.material if draft.material in materials else None
        self._refresh()

    def _refresh(self) -> None:
        """Check the draft and draw what follows from it."""
        checked = self._checked = check(self._draft, self._studio.workspace)
        for name, field in self._inputs.items():
            field.error = checked.problems.get(name)
        said = [*checked.general, *(v for k, v in checked.problems.items() if k == "material")]
        if said:
            lines = "".join(f"<p>{html.escape(text)}</p>" for text in said)
            self._problems.content = f'<div class="problem">{lines}</div>'
        else:
            self._problems.content = (
                '<div class="fine">This is a sound design.</div>'
                if checked.is_sound
                else '<div class="problem">Mend what is marked.</div>'
            )
        self._properties.content = (
            "" if checked.material is None else properties_html(checked.material)
        )
        if checked.spec is None or checked.material is None:
            return
        try:
            self._beam = Beam.of(checked.spec, checked.material)
            self._curve = None if self._beam is None else self._beam.curve()
            self._section.content = section_svg(
                section_of(checked.spec.geometry), f"section of {checked.spec.name}"
            )
        except RigError as error:
            self._beam = self._curve = None
            say(str(error), "negative")
        self._draw_responses()
        self._compare()

    def _draw_responses(self) -> None:
        """Draw the actuator at the slider's pressure, and all curves."""
        self._draw_curves(self._bend())

    def _slid(self) -> None:
        """The curves stay where they are: only their cursor moves, which browsers do at once."""
        at_kpa = self._bend()
        if at_kpa is not None:
            for chart in (self._angle, self._force):
                chart.run_chart_method("setOption", moved(at_kpa))

    def _bend(self) -> float | None:
        """Draw the actuator at the slider's pressure; tells it in kPa, None without a model."""
        beam = self._beam
        self._slider.set_visibility(beam is not None)
        if beam is None:
            self._bent.content = ""
            self._figures.text = "Beam theory is for the bending bellow; compute finite elements."
            return None
        bent = beam.bent(beam.top_pressure * number_of(self._slider.value, 0.0) / SLIDER_STEPS)
        self._bent.content = profile_svg(bent.profile, beam.window, bent.words)
        self._figures.text = bent.words
        return bent.pressure_kpa

    def _draw_curves(self, at_kpa: float | None) -> None:
        pinned = None if self._pinned is None else self._pinned.curve
        fields = self._fields if self._fields_hold else None
        curves = [c for c in (self._curve, pinned, fields) if c is not None]
        has_angle = any(c.angle_deg is not None for c in curves)
        first = [c.angle_deg if has_angle else c.displacement_mm for c in curves]
        name = "bending angle (deg)" if has_angle else "elongation (mm)"
        for chart, options in (
            (self._angle, response_options(curves, first, name, at_kpa)),
            (
                self._force,
                response_options(curves, [c.force_g for c in curves], "blocked force (g)", at_kpa),
            ),
        ):
            chart.options.clear()
            chart.options.update(options)
            chart.update()
            chart.set_visibility(bool(options["series"]))
        self._stale.set_visibility(self._fields is not None and fields is None)

    @property
    def _fields_hold(self) -> bool:
        """Whether what finite elements said is of the design as it is now."""
        of, now = self._computed_of, self._checked
        if of is None or now is None or of.spec is None or now.spec is None:
            return False
        return of.spec.geometry == now.spec.geometry and of.material == now.material

    def _design(self) -> Design | None:
        """What is there to be compared: beam theory, or finite elements where there is none."""
        curve = self._curve or (self._fields if self._fields_hold else None)
        if curve is None:
            return None
        return Design(self._draft, curve, None if self._beam is None else self._beam.mass_g)

    def _pin(self) -> None:
        design = self._design()
        if design is None:
            raise StudioError("there is no curve to pin yet: compute finite elements first.")
        label = f"{design.curve.label}, pinned"
        self._pinned = replace(design, curve=replace(design.curve, label=label))
        self._draw_responses()
        self._compare()

    def _unpin(self) -> None:
        self._pinned = None
        self._draw_responses()
        self._compare()

    def _compare(self) -> None:
        """Lay the pinned design beside the one that is edited."""
        now = self._design()
        if self._pinned is None or now is None:
            self._beside.content = ""
            return
        lines = "".join(
            f'<tr><th scope="row">{html.escape(row.what)}</th><td>{html.escape(row.pinned)}</td>'
            f"<td>{html.escape(row.now)}</td></tr>"
            for row in compared(self._pinned, now)
        )
        self._beside.content = (
            '<table class="plain"><thead><tr><th scope="col"></th><th scope="col">pinned</th>'
            f'<th scope="col">now</th></tr></thead><tbody>{lines}</tbody></table>'
        )

    def _save(self) -> None:
        assert self._checked is not None
        path = save(self._checked, self._studio.workspace, replacing=self._replace.value is True)
        say(f"saved as {path}", "positive")

    def _sound(self) -> Checked:
        if self._checked is None or not self._checked.is_sound:
            raise StudioError("mend the design first: see what is marked.")
        return self._checked

    def _export(self, kind: Format) -> None:
        checked = self._sound()
        self._exporting.start(self._exported, export, checked.spec, checked.material, kind)

    def _exported(self, file: File) -> None:
        ui.download.content(file.content, file.name)
        say(f"{file.name}, {len(file.content) / 1024:.0f} KiB", "positive")

    def _compute(self) -> None:
        checked = self._sound()
        assert checked.spec is not None
        if FINITE_ELEMENTS not in available_models(checked.spec.geometry.family):
            raise StudioError("this family has no finite element model.")
        self._computing.start(
            partial(self._computed, checked),
            finite_elements,
            checked.spec,
            checked.material,
            checked.spec.limits.pressure,
        )

    def _computed(self, of: Checked, answer: FieldsAnswer) -> None:
        self._fields, self._computed_of = answer.curve, of
        cautions = "".join(f'<p class="caution">{html.escape(c)}</p>' for c in answer.cautions)
        self._margin.content = f"<p>{html.escape(answer.margin)}</p>{cautions}"
        self._view.props(f'src="{self._studio.views.keep(answer.page)}"')
        self._view.set_visibility(True)
        self._draw_responses()
        self._compare()


def properties_html(material: MaterialSpec) -> str:
    """What the material is known by, folded away."""
    lines = "".join(
        f'<tr><th scope="row">{html.escape(p.what)}</th><td>{html.escape(p.value)}'
        f'<br><span class="muted">{html.escape(p.source)}</span></td></tr>'
        for p in properties_of(material)
    )
    return (
        f"<details><summary>What {html.escape(material.name)} is known by</summary>"
        f'<table class="plain">{lines}</table></details>'
    )
