"""A fingertip for asyncio."""

import asyncio
import contextlib
import functools
import os
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Coroutine
from types import TracebackType
from typing import Any, Concatenate, ParamSpec, TypeVar

from .device import Fingertip, block_end
from .errors import FingertipError, GoneError, NoFrameError
from .frames import Block, Frame
from .recording import RecordingWriter
from .wire import Info

Parameters = ParamSpec("Parameters")
Answer = TypeVar("Answer")
Made = TypeVar("Made", Fingertip, RecordingWriter)


def _waiting(
    method: Callable[Concatenate[Fingertip, Parameters], Answer],
) -> Callable[Concatenate["AsyncFingertip", Parameters], Coroutine[Any, Any, Answer]]:
    """The same in a thread."""

    @functools.wraps(method)
    async def wait(self: "AsyncFingertip", /, *arguments: Parameters.args, **options: Parameters.kwargs) -> Answer:
        return await asyncio.to_thread(method, self.sync, *arguments, **options)

    return wait


async def _made(make: Callable[[], Made]) -> Made:
    """In a thread. Cancelled, it waits for what is made and closes it."""
    making = asyncio.ensure_future(asyncio.to_thread(make))
    try:
        return await asyncio.shield(making)
    except asyncio.CancelledError:
        with contextlib.suppress(FingertipError):
            await asyncio.to_thread((await making).close)
        raise


class AsyncFingertip:
    """As Fingertip, whose arguments it takes, without ever holding up the event loop:

        async with AsyncFingertip() as fingertip:
            async for frame in fingertip: ...

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
        self._sync = await _made(self._open)

        def notify() -> None:
            with contextlib.suppress(RuntimeError):  # the loop is closed
                loop.call_soon_threadsafe(self._news.set)

        self._sync.on_frames(notify)
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        await asyncio.to_thread(self.sync.close)

    async def __aiter__(self) -> AsyncGenerator[Frame, None]:
        """Every frame, in order. Ends when it is closed; raises GoneError, NoFrameError."""
        loop, patience_s, is_late = asyncio.get_running_loop(), 0.0, False
        while True:
            self._news.clear()
            while (frame := self.sync.take_one()) is not None:
                is_late = False
                yield frame
            if self.sync.is_closed:
                return
            if is_late and not self.sync.is_returning:
                raise NoFrameError(f"{self.sync.description}: no frame in {patience_s:g} s")
            patience_s = self.sync.patience_s
            # wait_for() of Python before 3.12 swallows a cancellation that comes with news.
            timer = loop.call_later(patience_s, self._news.set)
            try:
                await self._news.wait()
            finally:
                timer.cancel()
            is_late = timer.when() <= loop.time()

    tare = _waiting(Fingertip.tare)
    set = _waiting(Fingertip.set)
    set_streams = _waiting(Fingertip.set_streams)
    latest = _waiting(Fingertip.latest)
    read_info = _waiting(Fingertip.read_info)
    read_health = _waiting(Fingertip.read_health)
    read_crash = _waiting(Fingertip.read_crash)

    async def record(self, path: "str | os.PathLike[str]", replace: bool = False) -> RecordingWriter:
        return await _made(functools.partial(self.sync.record, path, replace))

    async def read_block(self, frames: int | None = None, seconds: float | None = None) -> Block:
        """As Fingertip's; cancelled, what was taken is there for the next call."""
        is_whole = block_end(frames, seconds)
        taken: list[Frame] = []
        try:
            async with contextlib.aclosing(self.__aiter__()) as coming:
                while not is_whole(taken) and (frame := await anext(coming, None)) is not None:
                    taken.append(frame)
        except BaseException as error:
            if not (taken and isinstance(error, GoneError)):
                self.sync.give_back(taken)
                raise
        return Block(taken)

    async def blocks(self, frames: int) -> AsyncIterator[Block]:
        while len(block := await self.read_block(frames)):
            yield block
