"""`send` and `array` on a SonicSurface: every byte as its firmware would take it, faults of the port, and that it
always ends up silent."""

import contextlib
import fcntl
import json
import os
import pathlib
import re
import shlex
import shutil
import signal
import subprocess
import sys
import termios
import time
import unittest
import zlib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "cli"))

from support import PROGRAM, CommandTest, h5py, numpy  # noqa: E402
from sonicsurface_board import OFF, Board  # noqa: E402

# A sphere coarse enough for a run of a moment; only the array and the phases matter here.
SCENE = """\
name: bench
array: {ARRAY, at_mm: [10, 5, 0], rotate_deg: [0, 0, 30]}
body:
  sphere: {radius_mm: 8}
  place: {at_mm: [0, 0, 100]}
  edge_mm: 4
solve: {methods: [{fixed: {phases_rad: 1.3}}]}
evaluation: none
write: [h5]
"""

FULL = ["--max-level", "1"]  # the board has no other level
BRIEF = ["--seconds", "0.2"]  # as long as a pattern has to be heard
SILENT_WITHIN = 0.2  # s
SILENT_AFTER_STOP = 0.4  # s: of a process that hears no signal
DEVICE_FAILED = 4
BAD_INPUT = 2


def scene(array="sonicsurface: {}"):
    return SCENE.replace("ARRAY", array)


def positions(order=range(256), pitch=10.5, mirrored=False):
    """The board's places written out, in an order of choice."""
    places = [((n % 16 - 7.5) * (-pitch if mirrored else pitch), (n // 16 - 7.5) * pitch, 0) for n in order]
    points = ", ".join(f"[{x}, {y}, {z}]" for x, y, z in places)
    return f"positions: {{points_mm: [{points}], axes: [{', '.join(['[0, 0, 1]'] * len(places))}]}}"


class BoardTest(CommandTest):
    solved = {}  # scene -> bytes of its run.h5

    def board(self, **options):
        board = Board(**options)
        self.addCleanup(board.close)
        return board

    def run_of(self, name="a", array="sonicsurface: {}"):
        run = self.folder / name / "run.h5"
        if array not in self.solved:
            self.run_ok("run", self.write(f"{name}.yaml", scene(array)), "-o", name)
            self.solved[array] = run.read_bytes()
        run.parent.mkdir(exist_ok=True)
        run.write_bytes(self.solved[array])
        return run

    def with_drives(self, run, name, phases, amplitudes=None, complete=1):
        """A copy of a run with other drives."""
        path = self.folder / f"{name}.h5"
        shutil.copy(run, path)
        with h5py.File(path, "r+") as file:
            file["methods/fixed/phase"][:] = phases
            file.attrs["complete"] = complete
            if amplitudes is not None:
                file["methods/fixed/amplitude"][:] = amplitudes
        data = path.read_bytes()
        path.write_bytes(data + f"touchfield-crc32 {zlib.crc32(data):08x}\n".encode())
        return path

    def stream(self):
        """Frames that follow each other as fast as the line carries them."""
        run = self.run_of()
        return [*(self.with_drives(run, f"p{i}", numpy.full(256, 0.1 * i)) for i in range(8)), "--rate", 80, "--repeat"]

    def send(self, board, *arguments, options="", emit=True):
        return self.touchfield("send", *arguments, "--to", f"sonicsurface:{board.port}{options}", *FULL,
                               *(["--emit"] if emit else []))

    def send_ok(self, board, *arguments, options=""):
        done = self.send(board, *arguments, options=options)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(board.wait(lambda b: b.silent_at is not None))
        self.assertEqual(board.firmware.faults, [])
        return done

    def start(self, board, *arguments):
        """An emission that goes on until it is stopped."""
        process = subprocess.Popen(
            [PROGRAM, "send", *map(str, arguments), "--to", f"sonicsurface:{board.port}", *FULL, "--emit", "--seconds",
             "60", "--max-seconds", "60"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.kill)
        self.assertTrue(board.wait(lambda b: b.loud() and len(b.events) > 2), "it never emitted")
        return process

    @staticmethod
    def child_of(process):
        children = pathlib.Path(f"/proc/{process}/task/{process}/children").read_text().split()
        return int(children[0]) if len(children) == 1 else None

    def refused(self, board, *arguments, says, code=BAD_INPUT, command="send", full=True):
        done = self.touchfield(command, *arguments, *(FULL if full else []), "--emit")
        self.assertEqual(done.returncode, code, done.stderr)
        for phrase in [says] if isinstance(says, str) else says:
            self.assertIn(phrase, done.stderr)
        if board is not None:  # what a program wrote is there to read once it has ended
            time.sleep(0.02)
            self.assertEqual(bytes(board.heard), b"")


class Bytes(BoardTest):
    def test_every_phase_of_40_patterns(self):
        run = self.run_of()
        random = numpy.random.default_rng(1)
        phases = random.uniform(0, 2 * numpy.pi, (40, 256))
        phases[0] = numpy.linspace(0, 2 * numpy.pi, 256, endpoint=False)
        phases[1] = numpy.nextafter(2 * numpy.pi, 0)  # rounds up to a whole period, which is 0 and not `off`
        runs = [self.with_drives(run, f"p{i:03}", phases[i]) for i in range(40)]
        # The nearest of 32 steps of delay, all round the circle.
        wanted = [tuple(row) for row in numpy.floor(phases * 16 / numpy.pi + 0.5).astype(int) % 32]
        self.assertEqual(set(wanted[1]), {0})
        pending = list(range(40))
        for _ in range(8):  # a busy machine may drop frames of a sequence
            board = self.board()
            said = json.loads(self.send_ok(board, *[runs[i] for i in pending], "--rate", 40, "--json").stdout)
            sent = [tuple(pattern) for pattern in board.patterns()]
            self.assertEqual((said["sent"], said["frames"]), (len(sent), len(pending)))
            self.assertEqual(sent, [wanted[i] for i in pending if wanted[i] in sent], "another pattern or order")
            self.assertFalse(any(OFF in pattern for pattern in sent))
            if len(pending) == 40:
                error = numpy.abs(numpy.angle(numpy.exp(1j * (numpy.array(wanted) * numpy.pi / 16 - phases))))
                self.assertAlmostEqual(said["worst_phase_error_rad"], error.max(), places=12)
                self.assertAlmostEqual(said["rms_phase_error_rad"], numpy.sqrt((error ** 2).mean()), places=12)
            pending = [i for i in pending if wanted[i] not in sent]
            if not pending:
                return
        self.fail(f"{len(pending)} patterns were never sent")

    def test_only_amplitude_0_is_off(self):
        amplitudes = numpy.ones(256)
        amplitudes[[0, 17, 255]] = 0
        run = self.with_drives(self.run_of(), "some_off", numpy.full(256, 1.0), amplitudes)
        board = self.board()
        self.send_ok(board, run, *BRIEF)
        self.assertEqual([n for n, byte in enumerate(board.patterns()[0]) if byte == OFF], [0, 17, 255])
        half = self.with_drives(self.run_of("b"), "half", numpy.zeros(256), numpy.full(256, 0.5))
        self.refused(None, half, "--to", f"sonicsurface:{board.port}", says=["fully or not at all", "0.5"])

    def test_it_starts_and_ends_silent(self):
        run = self.run_of()
        board = self.board()
        self.assertTrue(board.loud(), "a board that was just powered emits")
        self.send_ok(board, run)
        self.assertEqual(set(board.events[0][1]), {OFF})
        self.assertTrue(board.firmware.silent())
        self.assertTrue(board.firmware.clocks)

    def test_the_second_board(self):
        board = self.board(number=1)
        self.send_ok(board, self.run_of(), *BRIEF, options="?firmware=secondary")
        self.assertEqual(len(board.patterns()), 1)
        # The same bytes leave the first board of the pair alone.
        board = self.board(number=0)
        self.send(board, self.run_of("b"), *BRIEF, options="?firmware=secondary")
        self.assertTrue(board.wait(lambda b: b.silent_at is not None))
        self.assertEqual(board.patterns(), [])

    def test_natural_order(self):
        run = self.with_drives(self.run_of(), "ramp", 2 * numpy.pi * (numpy.arange(256) % 32) / 32)
        board = self.board(order=list(range(256)))
        self.send_ok(board, run, *BRIEF, options="?order=natural")
        self.assertEqual(board.patterns(), [[n % 32 for n in range(256)]])

    def test_tactile_firmware(self):
        phases = numpy.random.default_rng(2).uniform(0, 2 * numpy.pi, 256)
        run = self.with_drives(self.run_of(), "random", phases)
        board = self.board(tactile=True)
        where = f"sonicsurface:{board.port}?firmware=tactile"
        self.refused(board, run, "--to", where, says=["modulates on its own", "none"])
        done = self.send_ok(board, run, *BRIEF, "--modulation", 200, options="?firmware=tactile")
        # 512 times a step of s + 1 ticks of 0.64 MHz make a period: s = 5 is the nearest to 200 Hz.
        self.assertEqual(board.firmware.step, 5)
        self.assertIn("208.3 Hz", done.stdout)
        # It drops the lowest bit of a phase: 16 steps.
        error = numpy.array(board.patterns()[0]) // 2 * numpy.pi / 8 - phases
        error -= 2 * numpy.pi * numpy.round(error / (2 * numpy.pi))
        self.assertLessEqual(numpy.abs(error).max(), numpy.pi / 16 * (1 + 1e-12))


class Permission(BoardTest):
    def test_nothing_without_emit(self):
        board = self.board()
        run = self.run_of()
        done = self.send(board, run, emit=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("--emit", done.stdout)
        for action in ("test", "walk", "list"):
            more = FULL + (["--count", "3"] if action == "walk" else []) if action != "list" else []
            self.run_ok("array", action, "--to", f"sonicsurface:{board.port}", *more)
        time.sleep(0.1)
        self.assertEqual(bytes(board.heard), b"")

    def test_caps(self):
        """All that the policy refuses is in emission_policy_test.cpp, what is no number in cli/command_line_test.py."""
        board = self.board()
        run = self.run_of()
        to = ["--to", f"sonicsurface:{board.port}"]
        self.refused(board, run, *to, full=False, says=["level = 1 must be <= 0.5", "--max-level"])
        self.refused(board, run, "--to", "dry-run", "--level", 0.6, full=False, says="level = 0.6 must be <= 0.5")
        for arguments, says in [
                (["--level", 0.5], ["--level = 0.5", "supply"]), (["--seconds", 10.5], ["10.5 s", "--max-seconds"]),
                (["--rate", 90], ["90", "<= 89"]), (["--modulation", 200], "cannot modulate")]:
            self.refused(board, run, *to, *arguments, says=says)

    def test_only_a_run_that_finished(self):
        board = self.board()
        to = ["--to", f"sonicsurface:{board.port}"]
        run = self.with_drives(self.run_of(), "broken_off", numpy.zeros(256), complete=0)
        self.refused(board, run, *to, says=["broken_off.h5: complete = 0", "touchfield run --from"])
        self.refused(None, self.run_of(), run, "--to", "dry-run", full=False, says="complete = 0")

    def test_only_this_array(self):
        board = self.board()
        to = ["--to", f"sonicsurface:{board.port}"]
        turned = [16 * (n % 16) + 15 - n // 16 for n in range(256)]  # by a quarter: the same board
        for name, array, says in [("pitch", "grid: {count: [16, 16], pitch_mm: 10.16}", ["pitch 10.160 mm", "10.500"]),
                                  ("mirrored", positions(mirrored=True), ["mirrored"])]:
            with self.subTest(name):
                self.refused(board, self.run_of(name, array), *to, says=["the run's array is not that of", *says])
        self.send_ok(board, self.run_of("turned", positions(turned)), *BRIEF)
        # One of a sequence is enough.
        self.refused(None, self.folder / "turned", self.folder / "pitch", *to, says="pitch")


class Faults(BoardTest):
    def device_fails(self, port, says, *more):
        self.refused(None, self.run_of(), "--to", f"sonicsurface:{port}", *more, code=DEVICE_FAILED, says=says)

    def test_missing_port(self):
        self.device_fails("/dev/ttyNONE", ["/dev/ttyNONE", "no device has this name"])

    def test_not_a_port(self):
        self.device_fails("/dev/null", "not a serial port")
        file = self.write("file", "in the way")
        self.device_fails(file, "not a serial port")
        self.assertEqual(file.read_text(), "in the way")

    def test_busy_port(self):
        board = self.board()
        fcntl.flock(board.slave, fcntl.LOCK_EX)
        self.device_fails(board.port, "busy")
        self.assertEqual(bytes(board.heard), b"")

    def test_busy_with_ourselves(self):
        board = self.board()
        process = self.start(board, self.run_of())
        guard = self.child_of(process.pid)
        other_name = self.folder / "board"
        other_name.symlink_to(board.port)
        self.device_fails(other_name, f"busy: process {guard} drives it; `kill {guard}` silences and frees it")
        heard = bytes(board.heard)
        self.is_refused("array", "off", "--to", f"sonicsurface:{board.port}", says=f"busy: process {guard} drives it", code=DEVICE_FAILED)
        self.assertEqual(bytes(board.heard), heard)
        self.assertTrue(board.loud())
        process.send_signal(signal.SIGTERM)
        process.wait(5)

    def test_unplugged(self):
        board = self.board()
        process = self.start(board, *self.stream())
        board.unplug()
        start = time.monotonic()
        self.assertEqual(process.wait(5), DEVICE_FAILED)
        self.assertLess(time.monotonic() - start, 2)
        said = process.stderr.read()
        self.assertIn("the device is lost", said)
        self.assertIn("could not be silenced", said)

    def test_a_port_that_takes_nothing(self):
        board = self.board()
        process = self.start(board, *self.stream())
        board.stop_reading()
        self.assertEqual(process.wait(10), DEVICE_FAILED)
        self.assertIn("took no more bytes", process.stderr.read())


class Emission(BoardTest):
    """Program and guard of an emission."""

    def emission(self, *arguments, **options):
        """Its board, program and guard. The board lets the next owner in, as a real port does once its last one closes it."""
        board = self.board(**options)
        process = self.start(board, *(arguments or [self.run_of()]))
        guard = self.child_of(process.pid)
        self.assertIsNotNone(guard)
        self.addCleanup(self.kill, guard)
        fcntl.ioctl(board.slave, termios.TIOCNXCL)
        return board, process, guard

    def kill(self, process):
        if self.runs(process):
            os.kill(process, signal.SIGKILL)

    @staticmethod
    def runs(process):
        """Whether a process is there that is more than a record for its parent."""
        try:
            status = pathlib.Path(f"/proc/{process}/stat").read_text()
        except (FileNotFoundError, ProcessLookupError):  # gone before or while it is read
            return False
        return status.rpartition(")")[2].split()[0] != "Z"

    def silent_after(self, board, stop, within=SILENT_WITHIN):
        start = time.monotonic()
        stop()
        self.assertTrue(board.wait(lambda b: b.silent_at is not None), "it is still on")
        self.assertLessEqual(board.silent_at - start, within)
        self.assertEqual(board.firmware.faults, [])

    def stays_silent(self, board, *processes):
        end = time.monotonic() + 5
        while any(map(self.runs, processes)) and time.monotonic() < end:
            time.sleep(0.01)
        self.assertEqual([process for process in processes if self.runs(process)], [], "it does not end")
        time.sleep(0.1)
        self.assertTrue(board.firmware.silent(), "something resumed")


class Stops(Emission):
    """What becomes of the array when program or guard are told to stop, stopped or killed. Nobody can silence it once both are killed, or
    while both are stopped."""

    HELD_BACK = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP, signal.SIGTTIN,
                 signal.SIGTTOU, signal.SIGUSR1, signal.SIGUSR2, signal.SIGALRM, signal.SIGPIPE, signal.SIGXCPU,
                 signal.SIGABRT, signal.SIGSEGV, signal.SIGRTMIN]

    def stopped_by(self, number, streaming=False):
        board, process, guard = self.emission(*(self.stream() if streaming else ()))
        self.silent_after(board, lambda: process.send_signal(number))
        process.wait(5)
        said = process.stderr.read()  # ends when the guard has ended too
        self.stays_silent(board, guard)
        return process.returncode, said

    def test_signals_to_the_program(self):
        streamed = [(number, True) for number in (signal.SIGINT, signal.SIGTSTP, signal.SIGKILL)]
        for number, streaming in [(number, False) for number in (*self.HELD_BACK, signal.SIGKILL)] + streamed:
            with self.subTest(number=number, streaming=streaming):
                code, said = self.stopped_by(number, streaming)
                killed = number == signal.SIGKILL
                self.assertEqual(code, -number if killed else 128 + number)
                name = "signal 34" if number == signal.SIGRTMIN else number.name
                self.assertIn("the program that drove the array is gone; the array is silent" if killed else f"stopped by {name}", said)

    def test_the_program_stopped(self):
        board, process, guard = self.emission()
        self.silent_after(board, lambda: process.send_signal(signal.SIGSTOP), SILENT_AFTER_STOP)
        self.stays_silent(board, guard)
        process.send_signal(signal.SIGCONT)
        self.assertEqual(process.wait(5), DEVICE_FAILED)
        self.assertIn("the program that drove the array said nothing for 250 ms; the array is silent", process.stderr.read())

    def test_keys_of_the_terminal(self):
        for key, number in ((b"\x03", signal.SIGINT), (b"\x1a", signal.SIGTSTP)):
            with self.subTest(number=number):
                board = self.board()
                terminal, slave = os.openpty()
                self.addCleanup(os.close, terminal)
                command = shlex.join([PROGRAM, "send", str(self.run_of()), "--to", f"sonicsurface:{board.port}", *FULL,
                                      "--emit", "--seconds", "60", "--max-seconds", "60"])
                # A shell with job control: the program is in a group of its own that the terminal speaks to.
                shell = subprocess.Popen(
                    ["sh", "-mc", f"{command}; echo ended with $?"], stdin=slave, stdout=slave, stderr=slave,
                    start_new_session=True, preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0))
                os.close(slave)
                self.addCleanup(shell.wait, 5)
                self.addCleanup(shell.kill)
                self.assertTrue(board.wait(lambda b: b.loud() and len(b.events) > 2), "it never emitted")
                self.silent_after(board, lambda: os.write(terminal, key))
                shell.wait(5)
                said = os.read(terminal, 65536).decode()
                self.assertIn(f"ended with {128 + number}", said)
                self.stays_silent(board)

    def test_signals_to_the_guard(self):
        numbers = (signal.SIGINT, signal.SIGTSTP, signal.SIGUSR1, signal.SIGSEGV, signal.SIGKILL, signal.SIGSTOP)
        for number, streaming in [(number, False) for number in numbers] + [(signal.SIGSTOP, True)]:
            with self.subTest(number=number, streaming=streaming):
                board, process, guard = self.emission(*(self.stream() if streaming else ()))
                self.silent_after(board, lambda: os.kill(guard, number), SILENT_AFTER_STOP if number == signal.SIGSTOP else SILENT_WITHIN)
                self.assertEqual(process.wait(5), DEVICE_FAILED)
                said = process.stderr.read()
                self.assertRegex(said, {signal.SIGKILL: "it was ended by SIGKILL", signal.SIGSTOP: "it was stopped by a signal"}.get(
                    number, f"stopped by {number.name}") + "; the array is silent")
                self.assertIn("note: sonicsurface", said)
                self.stays_silent(board, guard)

    def test_both_stopped_for_a_while(self):
        """As in a container that is paused, or a machine that sleeps."""
        board, process, guard = self.emission()
        for one in (guard, process.pid):
            os.kill(one, signal.SIGSTOP)
        time.sleep(0.6)
        self.assertTrue(board.loud(), "nobody can silence it")
        self.silent_after(board, lambda: [os.kill(one, signal.SIGCONT) for one in (guard, process.pid)])
        out, said = process.communicate(timeout=10)
        self.assertEqual(process.returncode, DEVICE_FAILED)
        self.assertRegex(said, r"error: link guard: it did not supervise the array for [0-9.]+ s \(at most 0.25 s\)")
        self.assertIn("; the array is silent", said)
        gap = re.search(r"gaps +1\ngaps begin at +0.05 s\nlongest gap +([0-9.]+) s\n", out)
        self.assertIsNotNone(gap, out)
        self.assertGreater(float(gap[1]), 0.5)
        self.stays_silent(board, guard)

    def test_a_stopped_guard_continues_when_the_program_is_gone(self):
        board, process, guard = self.emission()
        self.silent_after(board, lambda: [os.kill(guard, signal.SIGSTOP), process.kill()])
        self.stays_silent(board, guard)

    def test_a_silent_program(self):
        # It runs, but hangs in the line about its first transducer, which nobody reads.
        board = self.board()
        reader, writer = os.pipe()
        self.addCleanup(os.close, reader)
        os.set_blocking(writer, False)
        with contextlib.suppress(BlockingIOError):
            while True:
                os.write(writer, bytes(65536))
        with contextlib.suppress(BlockingIOError):
            while True:
                os.write(writer, b"0")
        os.set_blocking(writer, True)
        process = subprocess.Popen(
            [PROGRAM, "array", "walk", "--to", f"sonicsurface:{board.port}", *FULL, "--emit", "--count", "4", "--dwell",
             "2"], stdout=writer, stderr=subprocess.PIPE, text=True)
        os.close(writer)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.kill)
        self.assertTrue(board.wait(lambda b: b.loud() and len(b.events) > 2), "it never emitted")
        self.silent_after(board, lambda: None, SILENT_AFTER_STOP)
        os.read(reader, 1 << 20)
        self.assertEqual(process.wait(5), DEVICE_FAILED)
        self.assertIn("said nothing for 250 ms; the array is silent", process.stderr.read())


class Bench(BoardTest):
    def test_off(self):
        board = self.board()
        self.run_ok("array", "off", "--to", f"sonicsurface:{board.port}")
        self.assertTrue(board.wait(lambda b: b.silent_at is not None))
        self.assertEqual(board.patterns(), [])

    def test_walk(self):
        board = self.board()
        done = self.run_ok("array", "walk", "--to", f"sonicsurface:{board.port}", "--first", 14, "--count", 4,
                           "--dwell", 0.1, *FULL, "--emit")
        self.assertTrue(board.wait(lambda b: b.silent_at is not None))
        self.assertEqual([[n for n, byte in enumerate(pattern) if byte != OFF] for pattern in board.patterns()],
                         [[14], [15], [16], [17]])
        self.assertIn("transducer 16: unit 0 channel 16 at (-78.75, -68.25, 0.00) mm", done.stdout)

    def test_focus(self):
        board = self.board()
        point = numpy.array([20.0, -10.0, 120.0])
        self.run_ok("array", "test", "--to", f"sonicsurface:{board.port}", "--at-mm", *point, *FULL, *BRIEF, "--emit",
                    "--temperature-c", 25)
        self.assertTrue(board.wait(lambda b: b.silent_at is not None))
        delays = numpy.array(board.patterns()[0]) / 32  # [periods]
        places = numpy.array([[(n % 16 - 7.5) * 10.5, (n // 16 - 7.5) * 10.5, 0] for n in range(256)])
        wavelength = 343.21 * (298.15 / 293.15) ** 0.5 / 40  # [mm]
        arrival = numpy.linalg.norm(places - point, axis=1) / wavelength + delays  # [periods]
        # All in step but for half a step of rounding.
        spread = numpy.angle(numpy.exp(2j * numpy.pi * arrival) / numpy.exp(2j * numpy.pi * arrival).mean())
        self.assertLessEqual(numpy.abs(spread).max(), 1.5 * numpy.pi / 32)


class DryRun(BoardTest):
    def test_a_scene_reads_it_back(self):
        phases = numpy.random.default_rng(3).uniform(0, 2 * numpy.pi, 256)
        run = self.with_drives(self.run_of(), "random", phases)
        self.run_ok("send", run, "--to", "dry-run:q.txt?levels=32")
        text = scene().replace("{phases_rad: 1.3}", "{phases_file: q.txt}")
        self.run_ok("run", self.write("again.yaml", text), "-o", "q")
        with h5py.File(self.folder / "q/run.h5") as file:
            read = file["methods/fixed/phase"][:]
        steps = read * 32 / (2 * numpy.pi)
        self.assertLessEqual(numpy.abs(steps - numpy.round(steps)).max(), 1e-9)
        error = numpy.angle(numpy.exp(1j * (read - phases)))
        self.assertLessEqual(numpy.abs(error).max(), numpy.pi / 32 * (1 + 1e-9))

    def test_a_file_that_is_there_is_kept(self):
        run = self.run_of()
        kept = self.write("g-0002.txt", "mine")
        entries = self.entries()
        self.is_refused("send", run, run, run, "--to", "dry-run:g.txt", says="--force")
        self.assertEqual((kept.read_text(), self.entries()), ("mine", entries))
        self.run_ok("send", run, run, run, "--to", "dry-run:g.txt", "--force")
        for name in ("g-0001.txt", "g-0002.txt", "g-0003.txt"):
            self.assertEqual(len((self.folder / name).read_text().splitlines()), 257, name)


if __name__ == "__main__":
    unittest.main()
