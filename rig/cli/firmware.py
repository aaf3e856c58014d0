"""`rig firmware`: the firmware by itself."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from rig.link.schema import ParameterRule

firmware = typer.Typer(help="The firmware by itself, without an experiment.", no_args_is_help=True)
parameters = typer.Typer(
    help="What the board was told: gains, limits, geometry, with units and ranges.",
    no_args_is_help=True,
)
firmware.add_typer(parameters, name="parameters")
app.add_typer(firmware, name="firmware")

Bench = Annotated[str, typer.Option(help="Bench whose board is meant: a name or a file.")]
Port = Annotated[
    str | None, typer.Option(help="Port of the board, as /dev/ttyACM0, instead of the bench's.")
]
Keep = Annotated[
    bool,
    typer.Option(
        help="Keep the change when the supply goes. A Mega restarts whenever its port is opened, "
        "so what is not kept is gone with the next command."
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="For programs: JSON on the output.")]


@firmware.command()
def build(
    out: Annotated[Path, typer.Option(help="Folder for the image.")] = Path("build/firmware"),
) -> None:
    """Compile the Mega's image, and say how much of the Mega it takes.

    One commit gives one image, whoever compiles it, wherever.

    Example: `rig firmware build --out image`
    """
    from rig.board.image import build_image

    image = build_image(out)
    for name, used, budget in (
        ("flash", image.flash, image.flash_budget),
        ("memory", image.memory, image.memory_budget),
    ):
        typer.echo(f"{name:7} {used:7} bytes, {used / budget:4.0%} of a budget of {budget}")
    typer.echo(f"commit  {image.commit}")
    typer.echo(f"sha256  {image.sha256}")
    typer.echo(f"image   {image.path}")


@firmware.command()
def flash(
    bench: Bench = "mega",
    port: Port = None,
    image: Annotated[
        Path | None, typer.Option(help="Image to write; without it, one is compiled.")
    ] = None,
    dry_run: Annotated[bool, typer.Option(help="Only print the avrdude command.")] = False,
    force: Annotated[bool, typer.Option(help="Do not ask the board whether it is idle.")] = False,
) -> None:
    """Write the firmware to the Mega by avrdude, and ask the board who it is now.

    Refused while the board moves or holds pressure, or another program uses its port. A board that
    does not answer, or speaks another version, is flashed.

    Example: `rig firmware flash --port /dev/ttyACM0`
    """
    import shlex

    from rig.board.image import (
        IMAGE,
        build_image,
        flash_command,
        flash_image,
        require_flashable,
    )
    from rig.cli._board import serial_port

    folder = Path("build/firmware")
    where = serial_port(bench, port)
    if dry_run:
        typer.echo(shlex.join(flash_command(image or folder / IMAGE, where)))
        return
    written = image or build_image(folder).path
    require_flashable(written, where)
    if not force:
        _require_idle(bench, where)
    flash_image(written, where)
    typer.echo(f"{written} is on the board at {where}.")
    identify(bench, where)


def _require_idle(bench: str, port: str) -> None:
    """Raise BoardError if the board says that it is at work; one that says nothing is not."""
    from rig.board.errors import BoardError
    from rig.cli._board import talking
    from rig.link.errors import IdentityError, LinkLostError

    try:
        with talking(bench, port) as link:
            state = link.status.state if link.status is not None else "unknown"
    except LinkLostError:
        typer.echo(f"Nothing that knows rig answers at {port}; it is flashed all the same.")
        return
    except IdentityError as error:
        typer.echo(f"An older or newer firmware answers: {error}")
        return
    if state not in ("idle", "fault"):
        raise BoardError(
            f"the board at {port} is not idle but in the state '{state}'. Nothing was flashed. "
            "Vent it first, or flash with --force if you know better."
        )


@firmware.command()
def identify(bench: Bench = "mega", port: Port = None, as_json: AsJson = False) -> None:
    """Ask a board who it is: firmware, protocol, why it started, in which state it is.

    Example: `rig firmware identify --bench virtual`
    """
    import json

    from rig.cli._board import talking
    from rig.link.faults import HINTS

    with talking(bench, port) as link:
        identity, status = link.identity, link.status
        name = link.name
    assert identity is not None
    assert status is not None
    facts = {
        "where": name,
        "board": identity.board,
        "commit": identity.firmware_git,
        "protocol": identity.protocol_version,
        "schema": f"{identity.schema_crc:04x}",
        "reset_cause": status.reset_cause,
        "uptime_s": status.uptime_s,
        "state": status.state,
        "fault": status.fault,
        "homed": status.homed,
        "zeroed": status.zeroed,
    }
    if as_json:
        typer.echo(json.dumps(facts))
        return
    for label, fact in facts.items():
        typer.echo(f"{label:12}{fact}")
    if status.fault != "none":
        typer.echo(HINTS.get(status.fault, ""))


@firmware.command()
def trace(
    file: Annotated[Path, typer.Argument(help="VCD file to write.")],
    command: Annotated[
        str, typer.Option(help="Command of the board to trace, as `home` or `zero_pressure`.")
    ] = "home",
    argument: Annotated[float, typer.Option(help="Of the command, in its unit.")] = 0.0,
    seconds: Annotated[
        float, typer.Option(min=0.001, max=60, help="How long, in bench time.")
    ] = 1.0,
    bench: Annotated[str, typer.Option(help="Bench with an emulated board.")] = "emulated",
) -> None:
    """Write what happens at the pins of the emulated Mega to a VCD file.

    GTKWave and PulseView show it: step, direction, motor, valve, switches, HX711, transducer and
    the serial line.

    Example: `rig firmware trace homing.vcd --command home --seconds 2`
    """
    from rig.board.emulated import EmulatedBoard
    from rig.board.virtual import ready_at_once, virtual_board
    from rig.cli._board import ACTUATOR
    from rig.link.bus import SlcanBus
    from rig.link.client import RigLink
    from rig.spec.bench import EmulatedBoard as EmulatedBoardSpec
    from rig.spec.workspace import Workspace

    setup = Workspace.find().setup(ACTUATOR, bench)
    if not isinstance(setup.bench.board, EmulatedBoardSpec):
        raise typer.BadParameter(f"the bench '{bench}' has no emulated board, whose pins are seen.")
    board = virtual_board(ready_at_once(setup), 1)
    assert isinstance(board, EmulatedBoard)
    link = RigLink(SlcanBus(board))
    if command not in link.command_names:
        raise typer.BadParameter(
            f"the board has no command '{command}'; it has {', '.join(link.command_names)}."
        )
    link.open()
    board.trace(file)
    link.command(command, argument)
    link.wait(seconds)
    board.end_trace()
    pulses = board.stepper_figures().pulses
    typer.echo(f"{file}: {seconds:g} s of '{command}', {pulses} step pulses")


# --- parameters -------------------------------------------------------------------------------


@parameters.command("list")
def list_parameters(bench: Bench = "mega", port: Port = None, as_json: AsJson = False) -> None:
    """Show every parameter of a board with unit, range, default and meaning.

    Example: `rig firmware parameters list --bench virtual`
    """
    import json

    from rich.console import Console
    from rich.table import Table

    from rig.board.parameter_file import format_value
    from rig.cli._board import talking

    with talking(bench, port) as link:
        values = {name: link.read_parameter(name) for name in link.parameter_names}
    rules = _rules()
    if as_json:
        rows = [{**vars(rule), "value": values[name]} for name, rule in rules.items()]
        typer.echo(json.dumps(rows))
        return
    table = Table()
    for column in ("name", "value", "unit", "range", "default", "when", "meaning"):
        table.add_column(column, no_wrap=column != "meaning")
    for name, rule in rules.items():
        value, default = format_value(values[name]), format_value(rule.default)
        table.add_row(
            name,
            value if value == default else f"[bold]{value}[/]",
            rule.unit,
            f"{rule.low:g} to {rule.high:g}",
            default,
            "any" if rule.live else "idle",
            rule.meaning,
        )
    Console().print(table)


@parameters.command()
def get(
    name: Annotated[str, typer.Argument(help="As `rig firmware parameters list` shows it.")],
    bench: Bench = "mega",
    port: Port = None,
) -> None:
    """Print the value of one parameter, in the unit of its name.

    Example: `rig firmware parameters get deadband_kpa --bench virtual`
    """
    from rig.board.parameter_file import format_value
    from rig.cli._board import talking

    _rule(name)
    with talking(bench, port) as link:
        typer.echo(format_value(link.read_parameter(name)))


@parameters.command("set")
def set_parameter(
    name: Annotated[str, typer.Argument(help="As `rig firmware parameters list` shows it.")],
    value: Annotated[float, typer.Argument(help="In the unit of the name.")],
    bench: Bench = "mega",
    port: Port = None,
    keep: Keep = True,
) -> None:
    """Change one parameter. Every run writes those that the bench spec has.

    Example: `rig firmware parameters set leak_volume_ml 5 --port /dev/ttyACM0`
    """
    rule = _rule(name)
    if not rule.low <= value <= rule.high:
        raise typer.BadParameter(
            f"{name} is {value:g}; the board takes {rule.low:g} to {rule.high:g} {rule.unit}."
        )
    _write({name: value}, bench, port, keep)


@parameters.command()
def defaults(bench: Bench = "mega", port: Port = None, keep: Keep = True) -> None:
    """Give every parameter its default.

    Example: `rig firmware parameters defaults --port /dev/ttyACM0`
    """
    _write({name: rule.default for name, rule in _rules().items()}, bench, port, keep)


@parameters.command()
def save(bench: Bench = "mega", port: Port = None) -> None:
    """Have the board keep the parameters that are in force; only changed bytes wear its memory.

    Example: `rig firmware parameters save --port /dev/ttyACM0`
    """
    from rig.cli._board import talking

    with talking(bench, port) as link:
        link.save_parameters()
        typer.echo(f"The board at {link.name} keeps its parameters.")


@parameters.command()
def dump(
    file: Annotated[Path, typer.Argument(help="YAML file to write.")],
    bench: Bench = "mega",
    port: Port = None,
) -> None:
    """Write all parameters of a board to a YAML file.

    Example: `rig firmware parameters dump board.yaml --bench virtual`
    """
    from rig.board.parameter_file import format_parameters
    from rig.cli._board import talking

    with talking(bench, port) as link:
        values = {name: link.read_parameter(name) for name in link.parameter_names}
    try:
        file.write_text(format_parameters(values, _rules().values()), encoding="utf-8")
    except OSError as error:
        raise typer.BadParameter(f"{file} cannot be written: {error.strerror}.") from error
    typer.echo(f"{file}: {len(values)} parameters")


@parameters.command()
def load(
    file: Annotated[Path, typer.Argument(help="YAML file with some or all parameters.")],
    bench: Bench = "mega",
    port: Port = None,
    keep: Keep = True,
) -> None:
    """Write the parameters of a YAML file to a board; nothing is written if one is wrong.

    Example: `rig firmware parameters load board.yaml --port /dev/ttyACM0`
    """
    from rig.board.parameter_file import read_parameters

    _write(read_parameters(file, _rules()), bench, port, keep)


def _rules() -> dict[str, ParameterRule]:
    from rig.link.schema import load_schema

    return load_schema().parameters


def _rule(name: str) -> ParameterRule:
    from rig.spec.explain import did_you_mean

    rules = _rules()
    if name not in rules:
        raise typer.BadParameter(f"there is no parameter '{name}'{did_you_mean(name, rules)}.")
    return rules[name]


def _write(wanted: dict[str, float], bench: str, port: str | None, keep: bool) -> None:
    """Write parameters, print what changed, and have them kept."""
    from rig.board.parameter_file import format_value
    from rig.cli._board import is_simulated, talking

    rules = _rules()
    with talking(bench, port) as link:
        for name, value in wanted.items():
            before, after = link.read_parameter(name), link.write_parameter(name, value)
            if before != after:
                typer.echo(
                    f"{name}: {format_value(before)} -> {format_value(after)} {rules[name].unit}"
                )
        if keep:
            link.save_parameters()
        kept = "and kept" if keep else "but not kept"
        if is_simulated(bench, port):
            kept = "until this command ends"
        typer.echo(f"{len(wanted)} parameters are in force at {link.name}, {kept}.")


# --- a board to try it on ---------------------------------------------------------------------


@firmware.command()
def serve(
    actuator: Annotated[
        str, typer.Option(help="Actuator on the simulated bench: a name or a file.")
    ] = "bellow-bending",
    bench: Annotated[
        str, typer.Option(help="`virtual`, `emulated`, or a file of a simulated bench.")
    ] = "virtual",
    seed: Annotated[int, typer.Option(min=0, help="Of the simulated bench.")] = 1,
    link: Annotated[
        Path | None, typer.Option(help="Also make this symbolic link to the port.")
    ] = None,
) -> None:
    """Run the firmware with a simulated bench on a serial port, in real time.

    On the bench `virtual` that is the firmware compiled for this machine; on `emulated`, the
    image of the Mega.

    Every SLCAN program can talk to it. Ctrl-C ends it.

    Example:

        rig firmware serve

        python -m can.viewer -i slcan -c /dev/pts/3   # the port that it prints
    """
    from rich.console import Console

    from rig.board.pty import PtyServer
    from rig.board.virtual import virtual_board
    from rig.cli._calculation import calculating
    from rig.cli._interruption import catching_signals
    from rig.spec.workspace import Workspace

    setup = Workspace.find().setup(actuator, bench)
    with calculating(Console(stderr=True)) as job:
        server = PtyServer(virtual_board(setup, seed, job))
    if link is not None:
        link.unlink(missing_ok=True)
        link.symlink_to(server.port)
    typer.echo(f"The board is at {server.port}; watch it with")
    typer.echo(f"  python -m can.viewer -i slcan -c {server.port}")
    try:
        with catching_signals() as interruption:
            server.serve(lambda: interruption.requested)
    finally:
        server.close()
        if link is not None:
            link.unlink(missing_ok=True)
