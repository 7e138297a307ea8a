"""A test's own part in a world on simulated time: it starts the programs, and time passes only while it waits here.

    with SimulatedTime(TIME_KEEPER, folder) as world:
        tool = world.start([TOOL, "record", ...])
        world.until(lambda: os.path.exists(path))
        world.sleep(0.5)
        out, err = tool.communicate()

The programs are linked with simulated_clock.cpp; time_keeper.cpp says whose turn it is. Whatever this test does between two
waits takes no time. A program that ends a test's patience has waited simulated seconds for nothing, however busy the machine is.
"""

import array
import contextlib
import fcntl
import os
import signal
import socket
import struct
import subprocess

VARIABLE = "FINGERTIP_TIME_KEEPER"
PATIENCE_s = 60
HELLO, WAIT, INTERRUPTED, BYE, SPAWNED, HELD, TURNS, SIGNALLED = range(8)
FOR_EVER_us = (1 << 63) - 1
MOST_DESCRIPTORS = 128
ORDER = struct.Struct(f"=IiqI{MOST_DESCRIPTORS}hxxxx")
TURN = struct.Struct("=qq")
POLLIN = 1
PIPE_BYTES = 1 << 20


class TimedOut(AssertionError):
    pass


class Line:
    """A thread's connection to the keeper, which it tells by its first word that it is there."""

    def __init__(self, path):
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._socket.connect(path)
        self.now_us = self.others_us = 0  # as of its last turn; others: the first moment that another thread goes on by itself
        self.say(HELLO)

    def say(self, kind, pid=0, until_us=0, descriptors=()):
        events = [POLLIN] * len(descriptors) + [0] * (MOST_DESCRIPTORS - len(descriptors))
        rights = [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", descriptors))] if descriptors else []
        self._socket.sendmsg([ORDER.pack(kind, pid, until_us, len(descriptors), *events)], rights)

    def ask(self, kind, pid):
        self.say(kind, pid)
        return struct.unpack("=q", self._socket.recv(8))[0]

    def take_turn(self):
        """False: the world has ended."""
        told = self._socket.recv(TURN.size)
        if len(told) == TURN.size:
            self.now_us, self.others_us = TURN.unpack(told)
        return len(told) == TURN.size

    def wait(self, until_us, descriptors=()):
        """Until then, or until one of them can be read."""
        self.say(WAIT, until_us=until_us, descriptors=descriptors)
        return self.take_turn()

    def close(self):
        self._socket.close()


class SimulatedTime:
    def __init__(self, keeper, folder):
        path = os.path.join(folder, "time")
        self._keeper = subprocess.Popen([keeper, path], stdout=subprocess.PIPE, text=True)
        assert self._keeper.stdout.readline() == "ready\n"
        self._line = Line(path)
        os.chmod(folder, 0o755)  # for programs of other users
        os.chmod(path, 0o777)
        self.environment = {VARIABLE: path}
        self._processes = []
        self._turn(self._line.take_turn())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        """Ends what is left of the world."""
        self._line.close()
        with self._keeper:
            pass
        with contextlib.suppress(FileNotFoundError):
            os.unlink(self.environment[VARIABLE])
        for process in self._processes:
            process.end()

    @property
    def now_s(self):
        return self._line.now_us / 1e6

    def _turn(self, is_whole):
        if not is_whole:
            raise AssertionError(f"the time keeper ended with {self._keeper.wait()}; its words are on standard error")

    def wait(self, descriptors=(), seconds=PATIENCE_s):
        """Until one of them can be read, not longer than this."""
        self._turn(self._line.wait(self._line.now_us + max(1, round(seconds * 1e6)), list(descriptors)))

    def sleep(self, seconds):
        end_us = self._line.now_us + round(seconds * 1e6)
        while self._line.now_us < end_us:
            self.wait(seconds=(end_us - self._line.now_us) / 1e6)

    def until(self, condition, limit_s=PATIENCE_s, step_s=0.01):
        """The first true answer of condition, which is asked every step of the world's time."""
        end_us = self._line.now_us + round(limit_s * 1e6)
        while not (answer := condition()):
            if self._line.now_us >= end_us:
                raise TimedOut(f"waited {limit_s} s of the world's time")
            self.wait(seconds=step_s)
        return answer

    def start(self, arguments, **options):
        """As subprocess.Popen; both outputs are pipes unless said otherwise. Returns once it waits for the first time."""
        process = Process(self, arguments, **options)
        self._processes.append(process)
        self._line.say(SPAWNED, process.pid)
        self.wait(seconds=1e-6)
        return process

    def run(self, arguments, limit_s=PATIENCE_s, **options):
        """As subprocess.run with captured output; returns status, output and errors."""
        process = self.start(arguments, **options)
        out, err = process.communicate(limit_s)
        return process.returncode, out, err

    def turns(self, pid):
        return self._line.ask(TURNS, pid)

    def hold(self, pid, seconds):
        self._line.say(HELD, pid, FOR_EVER_us if seconds is None else self._line.now_us + round(seconds * 1e6))

    def will_signal(self, pid):
        """A signal comes there next: time stands until it has arrived."""
        self._line.say(SIGNALLED, pid)


class Output:
    """One of a process's two."""

    def __init__(self, process, name):
        self._process, self._name = process, name

    def readline(self):
        return self._process.readline(self._name)

    def read(self):
        """All that is left, once the process has ended."""
        self._process.wait()
        return self._process.read(self._name)

    def close(self):
        self._process.close_output(self._name)


class Process:
    """A program in this world, as subprocess.Popen has it; what it writes is text, unless text=False. Waits are of the world's time."""

    def __init__(
        self, world, arguments, env=None, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options
    ):
        self._world = world
        environment = {**(os.environ if env is None else env), **world.environment}
        self._popen = subprocess.Popen(arguments, env=environment, stdin=stdin, stdout=stdout, stderr=stderr, bufsize=0, **options)
        self.pid = self._popen.pid
        self.stdin = self._popen.stdin
        self._text = text
        self._ended = os.pidfd_open(self.pid)
        self._came = {}
        self.stdout, self.stderr = (None if getattr(self._popen, name) is None else Output(self, name) for name in ("stdout", "stderr"))
        for name in ("stdout", "stderr"):
            pipe = getattr(self._popen, name)
            if pipe is not None:
                fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, PIPE_BYTES)
                os.set_blocking(pipe.fileno(), False)
                self._came[name] = bytearray()

    @property
    def returncode(self):
        return self._popen.returncode

    def poll(self):
        return self._popen.poll()

    def _read(self, name):
        """Takes what there is. False: it has ended."""
        pipe = getattr(self._popen, name)
        while not pipe.closed:
            try:
                some = os.read(pipe.fileno(), 1 << 16)
            except BlockingIOError:
                return True
            if not some:
                pipe.close()
            self._came[name] += some
        return False

    def close_output(self, name):
        """It is not read any more."""
        getattr(self._popen, name).close()

    def _open_pipes(self):
        return [name for name in self._came if self._read(name)]

    def _said(self, raw):
        return raw.decode(errors="replace") if self._text else bytes(raw)

    def read(self, name="stdout"):
        """What has come and was not taken yet."""
        self._read(name)
        some, self._came[name] = self._came[name], bytearray()
        return self._said(some)

    def readline(self, name="stdout", limit_s=PATIENCE_s):
        """With its end, or what is left once it has ended."""
        end_s = self._world.now_s + limit_s
        while True:
            is_open = self._read(name)
            at = self._came[name].find(b"\n")
            if at >= 0 or not is_open:
                line = self._came[name][: at + 1] if at >= 0 else self._came[name]
                del self._came[name][: len(line)]
                return self._said(line)
            if self._world.now_s >= end_s:
                raise TimedOut(f"no line within {limit_s} s of the world's time; so far: {self._came}")
            self._world.wait([getattr(self._popen, name).fileno(), self._ended], end_s - self._world.now_s)

    def wait(self, limit_s=PATIENCE_s):
        """Its status; what it writes meanwhile is kept."""
        end_s = self._world.now_s + limit_s
        while self._popen.poll() is None:
            if self._world.now_s >= end_s:
                raise TimedOut(f"has not ended within {limit_s} s of the world's time; so far: {self._came}")
            pipes = [getattr(self._popen, name).fileno() for name in self._open_pipes()]
            self._world.wait([self._ended, *pipes], end_s - self._world.now_s)
        for name in self._came:
            self._read(name)
        return self._popen.returncode

    def communicate(self, limit_s=PATIENCE_s):
        self.wait(limit_s)
        return tuple(self.read(name) if name in self._came else None for name in ("stdout", "stderr"))

    def send_signal(self, number):
        if self.poll() is None:
            if number not in (signal.SIGSTOP, signal.SIGCONT):
                self._world.will_signal(self.pid)
            os.kill(self.pid, number)

    def hold_up(self, seconds=None):
        """As on a machine that is busy with others, or stopped: it gets no turn for so long, or until go_on."""
        self._world.hold(self.pid, seconds)

    def turns(self):
        """How often it ran until now: what it does with its time, whatever the machine's speed."""
        return self._world.turns(self.pid)

    def go_on(self):
        self._world.hold(self.pid, 0)

    def terminate(self):
        self.send_signal(signal.SIGTERM)

    def kill(self):
        self.send_signal(signal.SIGKILL)

    def end(self):
        """Whatever becomes of the test, nothing is left running. Needs no world any more."""
        self._popen.kill()
        for pipe in (self._popen.stdin, self._popen.stdout, self._popen.stderr):
            if pipe is not None:
                with contextlib.suppress(BrokenPipeError):
                    pipe.close()
        self._popen.wait()
        if self._ended >= 0:
            os.close(self._ended)
            self._ended = -1
