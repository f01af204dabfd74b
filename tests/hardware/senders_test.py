"""Two programs that want to drive one AUTD3 unit, started at random offsets: on one machine, where the lock keeps the second
away, and as on two machines, which know the unit by different addresses. Some are killed.

usage: senders_test.py [COUNT [SEED]]   default: 6 pairs, seed 1. Prints how long two of them drove the unit at once.
"""

import json
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "cli"))

from autd3_units import ASSIGN_ID, FRAME, RESET_ID, Emulator, Wire, sdk_of  # noqa: E402
from support import PROGRAM, SOURCE, CommandTest, unittest  # noqa: E402

SDK = sdk_of(SOURCE)
COUNT, SEED = 6, 1
SECONDS = 1.5  # of an emission, after half a second of opening
CLOSES = 0.02  # s after which a unit has forgotten its number
RESET, CLEAR, PATTERN = 0, 3, 0x16


class Unit(Wire):
    """Knows what its one unit emits: `patterns` holds (time, whether that is loud)."""

    def __init__(self, emulator):
        self.patterns = [(0, False)]
        self.expected, self.now_at, self.closes = 0, None, 0
        super().__init__(emulator, doors=2)

    def to_unit(self, data, one, host):
        super().to_unit(data, one, host)
        now = time.monotonic()
        if data[1] == RESET_ID:
            self.closes = min(self.closes, now + CLOSES)
        if data[1] != FRAME or now > self.closes or one is not self.near.get(self.now_at):
            return
        sequence, command = data[4], data[5]
        if command == RESET:
            self.expected = 0
        elif sequence == self.expected:
            self.expected = (sequence + 1) % 256
            if command in (CLEAR, PATTERN):
                self.patterns.append((now, command == PATTERN and any(data[-249:])))

    def from_unit(self, data, address, host):
        if data[1] == ASSIGN_ID:
            self.now_at, self.closes = address, float("inf")
        super().from_unit(data, address, host)

    def loud(self, at):
        return [loud for when, loud in self.patterns if when <= at][-1]

    def times(self, host, kind, down=True):
        """When datagrams of a kind went to the unit from a host, or came from it."""
        return [at for (at, down_, _, data), one in zip(list(self.datagrams), list(self.hosts))
                if one == host and down_ == down and data[1] == kind]


class Program:
    """One that makes a focus for a while, at the wire and one of its doors."""

    def __init__(self, port, *arguments):
        self.said = tempfile.TemporaryFile("w+")
        command = [PROGRAM, *(arguments or ["array", "test", "--emit", "--seconds", SECONDS, "--json"]), "--to", f"autd3-udp:[::1]:{port}"]
        self.process = subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, stderr=self.said, text=True)

    def guard(self):
        try:
            return [int(one) for one in pathlib.Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()]
        except FileNotFoundError:
            return []

    def kill(self, with_guard):
        for one in [self.process.pid, *(self.guard() if with_guard else [])]:
            os.kill(one, signal.SIGKILL)

    def end(self):
        """Its code, and whether it or its guard says that the array is silent."""
        out, _ = self.process.communicate(timeout=30)
        end = time.monotonic() + 2  # a guard may outlive its program
        while self.process.returncode == -signal.SIGKILL and time.monotonic() < end:
            time.sleep(0.05)
        self.said.seek(0)
        self.text = self.said.read()
        self.said.close()
        return self.process.returncode, "the array is silent" in self.text or (bool(out) and json.loads(out).get("silent", True))


class Senders(CommandTest):
    def pair(self, chance, locked, killed, off):
        with Emulator(SDK, 1) as emulator, Unit(emulator) as unit:
            ports = [unit.ports[0], unit.ports[0] if locked else unit.ports[1]]
            programs = [Program(ports[0])]
            time.sleep(chance.choice([chance.uniform(0, 0.05), chance.uniform(0, SECONDS if locked else SECONDS + 0.7)]))
            programs.append(Program(ports[1], *(["array", "off", "--json"] if off else [])))
            victim = chance.choice(programs)
            if killed:
                time.sleep(chance.uniform(0, 1))
                victim.kill(chance.choice([True, False]))
            ends = [program.end() for program in programs]
            texts = [program.text for program in programs]
            codes = [code for code, _ in ends]
            hosts = list(dict.fromkeys(unit.hosts))  # in the order in which they spoke
            for host in hosts:
                confirmed = unit.times(host, FRAME, down=False)
                if confirmed and any(says for (_, says), port in zip(ends, ports) if port == unit.ports[unit.door_of[host]]):
                    self.assertFalse(unit.loud(confirmed[-1]), f"one says that the array is silent: {texts}")
            if locked:
                again = Program(ports[0], "array", "off", "--json")  # whatever ended the first one frees the lock
                self.assertEqual(again.end(), (0, True), again.text)
            if locked and not killed:
                self.assertEqual((sorted(codes), len(hosts)), ([0, 4], 1), texts)
                refused = texts[codes.index(4)]
                self.assertRegex(refused, r"the units on \[::1\] port \d+: busy: process \d+ drives it; `kill \d+` silences and frees it")
            if locked or killed or len(hosts) < 2:
                return None
            drives = [unit.times(host, FRAME, down) for host in hosts for down in (True, False)]
            if [] in drives:
                return None  # one ended before it had opened the unit
            begins, ends = (drives[0][0], drives[2][0]), (drives[1][-1], drives[3][-1])
            for one, other in ((0, 1), (1, 0)):
                taken = [at for at in unit.times(hosts[other], RESET_ID) if begins[one] < at < ends[one] - 2 * CLOSES]
                if taken:
                    self.assertIn(4, codes, texts)
                if any(unit.loud(at) for at in taken):
                    self.assertIn("another program drives these units", texts[unit.door_of[hosts[one]]])
            both = min(drives[0][-1], drives[2][-1]) - max(begins)
            if both > 0:
                self.assertIn(4, codes, texts)
                self.assertLess(both, 1)
            return both

    def test_pairs(self):
        chance = random.Random(SEED)
        worst = 0
        for number in range(COUNT):
            locked, killed = number % 2 == 0, number % 5 == 4
            off = chance.random() < 0.2
            with self.subTest(f"pair {number} of seed {SEED}", locked=locked, killed=killed, off=off):
                worst = max(worst, self.pair(chance, locked, killed, off) or 0)
        print(f"two at once for at most {1e3 * worst:.0f} ms in {COUNT} pairs")


if __name__ == "__main__":
    if sys.argv[1:2] and sys.argv[1].isdigit():
        COUNT = int(sys.argv.pop(1))
    if sys.argv[1:2] and sys.argv[1].isdigit():
        SEED = int(sys.argv.pop(1))
    unittest.main()
