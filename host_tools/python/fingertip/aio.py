"""A fingertip for asyncio."""

import asyncio
import contextlib
import functools
from collections.abc import AsyncIterator
from types import TracebackType
from typing import Any

from .device import Fingertip
from .errors import GoneError, NoFrameError
from .frames import Block, Frame
from .wire import Health, Info


class AsyncFingertip:
    """As Fingertip, whose arguments it takes, without ever holding up the event loop:

        async with AsyncFingertip() as fingertip:
            async for frame in fingertip:
                ...

    sync is the Fingertip itself, whose latest(), info, health, statistics, clock and record return at once.
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

    async def tare(self, force: bool = False) -> None:
        """This and the following as Fingertip has them."""
        await asyncio.to_thread(self.sync.tare, force)

    async def set(self, **settings: Any) -> Info:
        return await asyncio.to_thread(self.sync.set, **settings)

    async def read_info(self) -> Info:
        return await asyncio.to_thread(self.sync.read_info)

    async def read_health(self) -> Health:
        return await asyncio.to_thread(self.sync.read_health)

    async def read_block(self, frames: int | None = None, seconds: float | None = None) -> Block:
        return await asyncio.to_thread(self.sync.read_block, frames, seconds)
