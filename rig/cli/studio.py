"""`rig studio`: designs, bench and runs in a browser."""

from __future__ import annotations

from typing import Annotated

import typer

from rig.cli.app import app


@app.command()
def studio(
    host: Annotated[
        str, typer.Option(help="Address to listen at; others than this computer's need --token.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=1, max=65535, help="Port to listen at.")] = 8137,
    token: Annotated[
        str | None,
        typer.Option(envvar="RIG_STUDIO_TOKEN", help="Secret that browsers must bring."),
    ] = None,
    verbose: Annotated[
        bool, typer.Option("--verbose", help="Write tracebacks of what fails in the server.")
    ] = False,
) -> None:
    """Open the studio of the workspace around the current directory; stop it with Ctrl-C.

    It listens on this computer only. One browser controls the bench, others watch; when the
    controlling one is gone, the bench is vented. See docs/studio.md.

    Example: `rig studio --port 8137`
    """
    from rig.spec.workspace import Workspace
    from rig.studio.access import Access

    access = Access.checked(host, port, token)
    try:
        from rig.studio.server import serve
    except ImportError as error:
        from rig.studio.errors import StudioError

        raise StudioError(
            f"the studio needs libraries that are not installed ({error.name}): "
            "`pip install 'rig[studio]'`."
        ) from None
    from rig.studio.state import Studio

    workspace = Workspace.find()
    place = "the library that ships with rig" if workspace.is_library else str(workspace.root)
    typer.echo(f"studio of {place}: http://{_shown(host)}:{port}/ (Ctrl-C ends it)")
    serve(Studio(workspace), access, verbose=verbose)


def _shown(host: str) -> str:
    return f"[{host}]" if ":" in host else host
