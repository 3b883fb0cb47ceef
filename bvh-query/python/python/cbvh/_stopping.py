"""What stops queries and bakes that take long."""

from __future__ import annotations

from types import TracebackType

from . import _cbvh


class Stop:
    """Stops queries and bakes of the thread that is in its block, by a flag that any thread may set, or after a time.

    >>> stop = cbvh.Stop()                                                   # doctest: +SKIP
    >>> button.on_click(stop.set)                                            # doctest: +SKIP
    >>> with stop:                                                           # doctest: +SKIP
    ...     answers = room.distance(robot, poses, parallel=True)

    When the flag is set, a query under way raises `StoppedError` within a millisecond or so, and so does each later one of the block
    until `clear`. ``Stop(after=seconds)`` does the same once so much time has passed in the block:

    >>> with cbvh.Stop(after=0.1):                                           # doctest: +SKIP
    ...     free = robot.is_free(starts, goals)

    A bake ends within a tenth of a second or so, and leaves no file behind; an output that was there stays as it was.

    Blocks may be nested, and each of them stops. A call about many poses has no answer if it is stopped. A flag that is not set affects no
    answer. Reading robots is not stopped, and neither are the first check of the topology of a file and the boxes that a mesh gets for
    its rays.
    """

    __slots__ = ("_flag",)

    def __init__(self, after: float | None = None) -> None:
        self._flag = _cbvh.Flag(after)

    def set(self) -> None:
        """Sets the flag, on any thread."""
        self._flag.set(True)

    def clear(self) -> None:
        """Clears the flag, so that queries are answered again. A time that has passed stays passed until the block ends."""
        self._flag.set(False)

    def is_set(self) -> bool:
        """Whether the flag is set. It is not set by time."""
        return self._flag.is_set()

    def __enter__(self) -> Stop:
        self._flag.enter()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._flag.leave()

    def __repr__(self) -> str:
        return f"<cbvh.Stop, {'set' if self.is_set() else 'not set'}>"
