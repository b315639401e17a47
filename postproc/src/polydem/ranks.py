"""The processes of a communicator of mpi4py that share simulations.

Outside of `run` all processes make the same calls, and tell each other before. Within `run` the root makes the calls,
those of its observers, too; it announces each, and the others repeat it.
"""

from __future__ import annotations

import atexit
import hashlib
import pickle
import sys
from collections.abc import Callable
from contextlib import suppress
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import InputError, PolydemError

if TYPE_CHECKING:
    from .library import Handle

#: Call of a process whose program ends
AT_EXIT = "exit"
#: Longest description of a call in a message
LONGEST = 80


class Ranks:
    """The processes of a communicator."""

    def __init__(self, comm: Any):
        from mpi4py import MPI

        self.comm = comm.Dup()
        # As in the program: who cannot communicate ends all processes.
        self.comm.Set_errhandler(MPI.ERRORS_ARE_FATAL)
        self._leads = self._follows = self._ended = False
        self._last = 0
        #: Handles that are not closed, by number
        self.handles: dict[int, Handle] = {}
        atexit.register(self._close_at_exit)

    def number(self) -> int:
        """A number for a simulation or state that all processes make, the same on all."""
        self._last += 1
        return self._last

    def meet(self, handle: Handle, method: str, *arguments: Any) -> None:
        """Before a call that all processes must make: the root announces it in `run`, else they compare theirs."""
        if self._follows:
            return
        self._refuse_others()
        if self._leads:
            self.comm.bcast((handle.number, method, arguments))
        else:
            self.agree(method, *arguments, of=handle)

    def agree(self, what: str, *arguments: Any, of: Handle | None = None) -> None:
        """Refuse calls that not all processes make alike. If one of them closes a simulation, all are closed."""
        if self._leads:
            raise InputError("an observer runs on the root alone, where it can look and act; simulations are made, "
                             "run, copied, restored and closed outside of it, by all processes")
        self._refuse_others()
        if self._ended:
            raise InputError("another process has ended")
        whose = f" of simulation {of.number}" if of is not None else ""
        calls = self.comm.allgather(f"{what}({', '.join(map(_described, arguments))}){whose}")
        if all(call == calls[0] for call in calls):
            return
        self._ended = any(call.startswith(AT_EXIT) for call in calls)
        if self._ended or any(call.startswith("close") for call in calls):
            self.close_all()
        other = next(rank for rank, call in enumerate(calls) if call != calls[0])
        same = next((k for k, (a, b) in enumerate(zip(calls[0], calls[other])) if a != b), len(calls[0]))
        mine, theirs = (call[:LONGEST] if same < LONGEST // 2 else f"{call[:20]}...{call[same - 20:same + LONGEST]}"
                        for call in (calls[0], calls[other]))
        raise InputError(f"all processes must make the same calls: process 0 makes {mine}, process {other} {theirs}")

    def _refuse_others(self) -> None:
        """Nobody would answer an observer that uses a simulation of another communicator."""
        if any(each._leads for each in _KNOWN if each is not self):
            raise InputError("an observer runs on one process alone, and cannot use a simulation of another "
                             "communicator")

    def run(self, handle: Handle, arguments: tuple[Any, ...], function: Callable[[], Any]) -> Any:
        """Call a function on the root; give its value, or raise its exception, on all processes."""
        self.agree("run", *arguments, of=handle)
        if self.comm.rank == 0:
            self._leads, value, failure = True, None, None
            try:
                value = function()
            except BaseException as error:    # Whatever it is, the others must not wait.
                failure = error
            self._leads = False
            self.comm.bcast((0, "", (value, _sendable(failure))))
        else:
            value, failure = self._follow()
        if failure is not None:
            raise failure
        return value

    def _follow(self) -> tuple[Any, ...]:
        """Repeat the calls of the root until one has no name: its arguments are how the `run` has ended."""
        self._follows = True
        try:
            while True:
                number, method, arguments = self.comm.bcast(None)
                if not method:
                    return tuple(arguments)
                # The root has the same exception, and its observer may go on.
                with suppress(Exception):
                    getattr(self.handles[number], method)(*arguments)
        finally:
            self._follows = False

    def close_all(self) -> None:
        """Close all simulations, on all processes."""
        for handle in list(self.handles.values()):
            try:
                handle.free()
            except PolydemError:
                pass    # The result is that of a run that was killed; another error is on its way.
            handle.pointer = None

    def _close_at_exit(self) -> None:
        from mpi4py import MPI

        if self._ended or MPI.Is_finalized():
            return
        try:
            self.agree(AT_EXIT)
            self.close_all()
        except PolydemError:
            pass    # The others say what has happened.


#: All that were made, which simulations on the same processes share
_KNOWN: list[Ranks] = []


def ranks_of(comm: Any) -> Ranks | None:
    """The processes of a communicator; None: this one alone."""
    if comm is None:
        return None
    mpi = sys.modules.get("mpi4py.MPI")    # Whoever has a communicator has imported it.
    if mpi is None or not isinstance(comm, mpi.Intracomm) or comm == mpi.COMM_NULL:
        raise InputError(f"comm is an intracommunicator of mpi4py, such as MPI.COMM_WORLD, not {comm!r}")
    if comm.size == 1:
        return None
    for known in _KNOWN:
        if mpi.Comm.Compare(comm, known.comm) in (mpi.IDENT, mpi.CONGRUENT):
            return known
    _KNOWN.append(Ranks(comm))
    return _KNOWN[-1]


def _described(value: Any) -> str:
    """A value in a message; arrays and long texts by a hash."""
    if isinstance(value, np.ndarray):
        value = f"{value.dtype}{value.shape} {hashlib.sha256(value.tobytes()).hexdigest()[:16]}"
    elif isinstance(value, str) and "\n" in value:
        value = hashlib.sha256(value.encode()).hexdigest()[:16]
    elif isinstance(value, Real):
        number = float(value)
        value = int(number) if number.is_integer() else number
    return value if isinstance(value, str) else repr(value)


def _sendable(error: BaseException | None) -> BaseException | None:
    """An exception, or if it cannot travel one that says what it was."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:    # Whatever pickle makes of it
        words = ""
        with suppress(Exception):
            words = f": {error}"
        return PolydemError(f"an observer has failed on the root: {type(error).__name__}{words}")
    return error
