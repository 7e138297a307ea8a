"""A fingertip for asyncio."""

import asyncio
import contextlib
import functools
from collections.abc import AsyncIterator, Callable, Coroutine
from types import TracebackType
from typing import Any, Concatenate, ParamSpec, TypeVar

from .device import Fingertip
from .errors import GoneError, NoFrameError
from .frames import Block, Frame
from .wire import Info

Parameters = ParamSpec("Parameters")
Answer = TypeVar("Answer")


def _waiting(
    method: Callable[Concatenate[Fingertip, Parameters], Answer],
) -> Callable[Concatenate["AsyncFingertip", Parameters], Coroutine[Any, Any, Answer]]:
    """The same in a thread."""

    @functools.wraps(method)
    async def wait(self: "AsyncFingertip", /, *arguments: Parameters.args, **options: Parameters.kwargs) -> Answer:
        return await asyncio.to_thread(method, self.sync, *arguments, **options)

    return wait


class AsyncFingertip:
    """As Fingertip, whose arguments it takes, without ever holding up the event loop:

        async with AsyncFingertip() as fingertip:
            async for frame in fingertip:
                ...

    sync is the Fingertip itself, whose health, statistics and clock are there at once.
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        self._open = functools.partial(Fingertip, *arguments, **options)
        self._sync: Fingertip | None = None
        self._news = asyncio.Event()

    @property
    def sync(self) -> Fingertip:
        if self._sync is None:
            raise GoneError("not open; use async with")
        return self._sync

    @property
    def info(self) -> Info:
        return self.sync.info

    async def __aenter__(self) -> "AsyncFingertip":
        loop = asyncio.get_running_loop()
        self._sync = await asyncio.to_thread(self._open)

        def notify() -> None:
            with contextlib.suppress(RuntimeError):  # the loop is closed
                loop.call_soon_threadsafe(self._news.set)

        self._sync.on_frames(notify)
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        await asyncio.to_thread(self.sync.close)

    async def __aiter__(self) -> AsyncIterator[Frame]:
        """Every frame, in order. Ends when it is closed; raises GoneError, NoFrameError."""
        while True:
            self._news.clear()
            while (frame := self.sync.take_one()) is not None:
                yield frame
            if self.sync.is_closed:
                return
            if not self._news.is_set():
                patience_s = self.sync.patience_s
                try:
                    await asyncio.wait_for(self._news.wait(), patience_s)
                except (TimeoutError, asyncio.TimeoutError):
                    if not self.sync.is_returning:
                        raise NoFrameError(f"{self.sync.description}: no frame in {patience_s:g} s") from None

    tare = _waiting(Fingertip.tare)
    set = _waiting(Fingertip.set)
    set_streams = _waiting(Fingertip.set_streams)
    latest = _waiting(Fingertip.latest)
    read_info = _waiting(Fingertip.read_info)
    read_health = _waiting(Fingertip.read_health)
    read_crash = _waiting(Fingertip.read_crash)
    read_block = _waiting(Fingertip.read_block)
    record = _waiting(Fingertip.record)

    async def blocks(self, frames: int) -> AsyncIterator[Block]:
        while len(block := await self.read_block(frames)):
            yield block
