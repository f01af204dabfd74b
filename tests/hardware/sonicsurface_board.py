"""A SonicSurface on a pseudo-terminal: its firmware as a state machine that records what each transducer would emit."""

import os
import pty
import select
import threading
import time

OFF = 32
ROWS = COLUMNS = 16

# Which byte of a group of eight drives which place of a block that is four columns wide and two rows high.
GROUP = [[0, 7, 1, 2],
         [4, 3, 6, 5]]


def byte_of(row, column):
    """Number of the byte of a frame that drives a transducer; rows from -y, columns from -x."""
    return 64 * (column // 4) + 8 * (row // 2) + GROUP[row % 2][column % 4]


WIRING = [byte_of(n // COLUMNS, n % COLUMNS) for n in range(ROWS * COLUMNS)]


class Firmware:
    """Phases of one board. Powered up, it emits: every phase is 0."""

    def __init__(self, tactile=False, number=0):
        self.tactile = tactile
        self.number = number
        self.listens = True
        self.count = 0
        self.back = [0] * 256
        self.front = [0] * 256
        self.clocks = True
        self.step = 10
        self.faults = []

    def hear(self, byte):
        """Returns whether a commit changed what is emitted."""
        if byte == 254 and self.listens:
            self.count = 0
        elif byte == 253:
            self.front, self.back = self.back, self.front
            self.count = 0
            return True
        elif self.tactile and byte >> 5 == 5:
            self.step = byte & 31
        elif not self.tactile and byte in (150, 151):
            self.clocks = byte == 151
        elif not self.tactile and byte in (192, 193):
            self.listens = byte - 192 == self.number
        elif self.listens:
            if byte > OFF or self.count > 255:
                self.faults.append((self.count, byte))
            else:
                self.back[self.count] = byte
            self.count += 1
        return False

    def silent(self):
        """Off, and off again after a stray commit."""
        return set(self.front) == set(self.back) == {OFF}


class Board:
    """Reads the master side in a thread of its own; `events` holds (time, phases in the array's order) of each
    commit."""

    def __init__(self, tactile=False, number=0, order=None):
        self.master, self.slave = pty.openpty()
        self.port = os.ttyname(self.slave)
        self.order = WIRING if order is None else order
        self.firmware = Firmware(tactile, number)
        self.heard = bytearray()
        self.events = []
        self.silent_at = None  # since when it is silent
        self.reading = True
        self.changed = threading.Condition()
        self.thread = threading.Thread(target=self._read, daemon=True)
        self.thread.start()

    def _read(self):
        while self.reading:
            if not select.select([self.master], [], [], 0.02)[0]:
                continue
            try:
                data = os.read(self.master, 65536)
            except OSError:
                return
            now = time.monotonic()
            with self.changed:
                self.heard += data
                for byte in data:
                    if self.firmware.hear(byte):
                        front = self.firmware.front
                        self.events.append((now, [front[self.order[n]] for n in range(256)]))
                silent = self.firmware.silent()
                self.silent_at = (self.silent_at or now) if silent else None
                self.changed.notify_all()

    def wait(self, condition, seconds=10):
        """Waits until condition(self) holds; returns whether it does."""
        with self.changed:
            return self.changed.wait_for(lambda: condition(self), seconds)

    def loud(self):
        return any(phase != OFF for phase in self.firmware.front)

    def patterns(self):
        """What was emitted between the silence at the start and that at the end."""
        with self.changed:
            return [phases for _, phases in self.events if set(phases) != {OFF}]

    def stop_reading(self):
        self.reading = False
        self.thread.join()

    def unplug(self):
        self.stop_reading()
        os.close(self.master)
        self.master = -1

    def close(self):
        self.stop_reading()
        for descriptor in (self.master, self.slave):
            if descriptor >= 0:
                os.close(descriptor)
