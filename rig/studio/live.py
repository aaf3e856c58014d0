"""The live WebSocket: what the bench says, at 25 Hz, and the pulse of whoever listens.

A browser answers every message. The answer is what keeps its seat: timers of a page in the
background are slowed down by browsers, answers are not. A browser that lags gets no more until it
has caught up, so that nothing piles up.
"""

from __future__ import annotations

import asyncio
import contextlib
import json

from fastapi import APIRouter
from starlette.websockets import WebSocket, WebSocketDisconnect

from rig.studio.desk import Desk
from rig.studio.look import NOTHING

PERIOD_S = 0.04
QUIET_S = 0.5
"""Between messages to a page that does not show the bench."""
MOST_UNANSWERED = 10
SESSION_CHARACTERS = 80


def live_route(desk: Desk) -> APIRouter:
    """`/live?session=TAB&watch=1`."""
    router = APIRouter()

    @router.websocket("/live")
    async def live(socket: WebSocket, session: str = "", watch: bool = False) -> None:
        if not 0 < len(session) <= SESSION_CHARACTERS:
            await socket.close(1008)
            return
        await socket.accept()
        desk.watchers += watch
        listener = _Listener(desk, socket, session, watch)
        tasks = [asyncio.create_task(listener.hear()), asyncio.create_task(listener.tell())]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            desk.watchers -= watch
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            with contextlib.suppress(RuntimeError, WebSocketDisconnect):  # closed already
                await socket.close()

    return router


class _Listener:
    def __init__(self, desk: Desk, socket: WebSocket, session: str, watch: bool) -> None:
        self._desk = desk
        self._socket = socket
        self._session = session
        self._watch = watch
        self._unanswered = 0

    async def hear(self) -> None:
        with contextlib.suppress(WebSocketDisconnect, RuntimeError, KeyError):
            while True:
                await self._socket.receive_text()
                self._unanswered = max(0, self._unanswered - 1)
                self._desk.seat.heard(self._session)

    async def tell(self) -> None:
        number, shown = 0, NOTHING
        clock = asyncio.get_running_loop().time
        next_s = clock()
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            while True:
                if self._unanswered < MOST_UNANSWERED:
                    text, number = message(self._desk, self._session, self._watch, number)
                    self._unanswered += 1
                    await self._socket.send_text(text)
                    if self._watch and self._desk.look is not shown:
                        shown = self._desk.look
                        await self._socket.send_bytes(shown.jpeg)
                # what sending took does not make messages rarer; what was missed is not made up for
                next_s = max(next_s + (PERIOD_S if self._watch else QUIET_S), clock())
                await asyncio.sleep(next_s - clock())


def message(desk: Desk, session: str, watch: bool, number: int) -> tuple[str, int]:
    """What a browser is told, and the number of the last sample in it."""
    samples = desk.scope.since(number) if watch else []
    reading, activity, holder = desk.scope.reading(), desk.activity, desk.seat.holder
    force, look = desk.force_g, desk.look
    content = {
        "connected": activity.connected,
        "state": reading.state if activity.connected else "",
        "fault": reading.fault if activity.connected else "none",
        "hint": reading.hint,
        "flags": ", ".join(reading.flags),
        "force": None if force is None else round(force, 3),
        "deformation": None if look.value is None else round(look.value, 3),
        "deformation_u95": None if look.u95 is None else round(look.u95, 3),
        "deformation_s": round(look.time_s, 3),
        "no_deformation": look.reason,
        "quantity": desk.measurand.quantity,
        "unit": desk.measurand.unit,
        "decimals": desk.measurand.decimals,
        "doing": activity.doing,
        "done": activity.done,
        "total": activity.total,
        "said": activity.said,
        "question": activity.question,
        "may": desk.open_to(session),
        "control": "free" if holder is None else "yours" if holder == session else "another's",
        "samples": [[round(value, 3) for value in sample[1:]] for sample in samples],
    }
    return json.dumps(content), samples[-1][0] if samples else number
