"""AUTD3 units for tests: the vendor's emulator in a process of its own, and a wire to it that keeps every datagram, and
loses, delays or repeats some. Several programs may be at the wire, as from machines of their own: each through a door."""

import contextlib
import heapq
import itertools
import pathlib
import random
import select
import socket
import subprocess
import sys
import threading
import time

FRAME, READ_UNIT, RESET_ID, ASSIGN_ID = 0, 1, 2, 4


class Emulator:
    """The vendor's emulator of a chain of units, from the folder of a version of its SDK."""

    def __init__(self, sdk, units):
        self.units = units
        self.process = subprocess.Popen([sys.executable, __file__, sdk, str(units)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.port = int(self.process.stdout.readline())

    def reboot(self, unit):
        self.process.stdin.write(f"{unit}\n")
        self.process.stdin.flush()
        self.process.stdout.readline()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.stdin.close()
        self.process.wait(10)
        self.process.stdout.close()


class Wire:
    """Between hosts and an emulator. `datagrams` holds (time, to the units?, unit or None, bytes), and `hosts` the address
    of the host of each.

    With an interface it is where real units are: in the group of all nodes on that network. `ports` are those of the doors:
    a program knows the units by the door, so programs at two of them are as on two machines."""

    def __init__(self, emulator, seed=0, lost=0.0, delayed=0.0, repeated=0.0, constant=0.0, change=None, interface=None, doors=1):
        self.emulator = ("::1", emulator.port)
        self.random = random.Random(seed)
        self.lost, self.delayed, self.repeated = lost, delayed, repeated
        self.constant = constant  # delay of every datagram [s]
        self.order = itertools.count()
        self.change = change  # of what a unit answers
        self.datagrams, self.hosts = [], []
        self.numbers = {}  # of the emulator's addresses
        self.asked = {}  # numbers that were given, by message
        self.late = []
        self.interface = interface
        self.doors = [self.bound(interface, 44336 if interface else 0) for _ in range(doors)]
        self.far = {}  # by the host's address
        self.door_of = {}  # the door that a host knocked at first
        self.near = {}  # by the emulator's address
        self.ports = [door.getsockname()[1] for door in self.doors]
        self.port = self.ports[0]
        self.end = threading.Event()
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    @staticmethod
    def bound(interface=None, port=0):
        made = socket.socket(socket.AF_INET6, socket.SOCK_DGRAM)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        if interface:
            made.setsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, interface.encode())
        made.bind(("::" if interface else "::1", port))
        return made

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.end.set()
        self.thread.join(10)
        for one in (*self.doors, *self.far.values(), *self.near.values()):
            one.close()

    def run(self):
        while not self.end.is_set():
            wait = max(0, min(0.02, self.late[0][0] - time.monotonic())) if self.late else 0.02
            hosts = {one: host for host, one in self.far.items()}
            for one in select.select([*self.doors, *hosts, *self.near.values()], [], [], wait)[0]:
                with contextlib.suppress(OSError):
                    data, address = one.recvfrom(4096)
                    if one in hosts:
                        self.from_unit(data, address[:2], hosts[one])
                    else:
                        self.to_unit(data, one, address)
            while self.late and self.late[0][0] <= time.monotonic():
                _, _, one, data, address = heapq.heappop(self.late)
                one.sendto(data, address)

    def kept(self, down, unit, data, host):
        self.hosts.append(host)
        self.datagrams.append((time.monotonic(), down, unit, data))

    def to_unit(self, data, one, host):
        if host not in self.far:
            self.far[host] = self.bound()
            self.door_of[host] = self.doors.index(one)
        address = next((far for far, near in self.near.items() if near is one), self.emulator)
        if data[1] == ASSIGN_ID:
            self.asked[data[2:4]] = data[4]
        self.kept(True, self.numbers.get(address), data, host)
        self.send(self.far[host], data, address)

    def from_unit(self, data, address, host):
        if address not in self.near:
            self.near[address] = self.bound(self.interface)
        if data[1] == ASSIGN_ID and data[2:4] in self.asked:
            self.numbers[address] = self.asked[data[2:4]]
        if self.change:
            data = self.change(data)
        self.kept(False, self.numbers.get(address), data, host)
        self.send(self.near[address], data, host)

    def send(self, one, data, address):
        if self.random.random() < self.lost:
            return
        for _ in range(2 if self.random.random() < self.repeated else 1):
            late = self.constant + (self.random.uniform(0, 0.03) if self.random.random() < self.delayed else 0)
            if late > 0:
                heapq.heappush(self.late, (time.monotonic() + late, next(self.order), one, data, address))
            else:
                one.sendto(data, address)

    def commands(self, unit, since=0.0):
        """(time, bytes from the command's number on) of the frames to a unit; a repeated one counts once."""
        seen = set()
        found = []
        for at, down, number, data in list(self.datagrams):
            if down and number == unit and data[1] == FRAME and at >= since and data[2:4] not in seen:
                seen.add(data[2:4])
                found.append((at, data[5:]))
        return found

    def confirmed(self, unit, body, since=0.0):
        """When a unit first answered a frame with these bytes from the command's number on; None if it has not."""
        sent = set()
        for at, down, number, data in list(self.datagrams):
            if number != unit or data[1] != FRAME or at < since:
                continue
            if down and data[5:] == body:
                sent.add(data[2:4])
            elif not down and data[2:4] in sent:
                return at
        return None


class Observer:
    """Asks units directly, past the program that drives them; their next command must then begin with a reset."""

    def __init__(self, emulator, version=3):
        self.version = version
        self.socket = socket.socket(socket.AF_INET6, socket.SOCK_DGRAM)
        self.socket.settimeout(1)
        self.message = 0
        self.units = {}
        self.ask(("::1", emulator.port), READ_UNIT, b"", emulator.units)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def ask(self, address, kind, body, count=1):
        self.message += 1
        head = bytes([self.version, kind, self.message & 255, self.message >> 8])
        self.socket.sendto(head + body, address)
        answers = []
        with contextlib.suppress(TimeoutError):
            while len(answers) < count:
                data, come_from = self.socket.recvfrom(4096)
                if data[1:4] == head[1:4]:
                    answers.append(data)
                    if kind == READ_UNIT and data[5] != 255:
                        self.units[data[5]] = come_from[:2]
        return answers

    def read(self, unit, command):
        """What a unit answers to a command without data."""
        time_of_execution = b"\0\0\0\0" if self.version > 2 else b""
        self.ask(self.units[unit], FRAME, bytes([0, 0]) + time_of_execution)
        return self.ask(self.units[unit], FRAME, bytes([0, command]) + time_of_execution)[0][16:]

    def switched_off(self, unit):
        return bool(self.read(unit, 0xE7)[0] & 0x80)

    def counters(self, unit):
        names = ["dropped", "repeated", "out_of_order", "refused", "executed", "not_sent", "failsafe"]
        data = self.read(unit, 0xE8)
        return {name: int.from_bytes(data[4 * k : 4 * k + 4], "little") for k, name in enumerate(names)}


def sdk_of(source, version="0.12"):
    """The folder of a version of the SDK, or an end that says that the test is skipped."""
    folder = pathlib.Path(source) / "build/autd3_sdk" / version
    if not folder.exists():
        print(f"skipped: there is no AUTD3 SDK at {folder}: scripts/setup_autd3 fetches the vendor's")
        sys.exit(77)
    return folder


def emulate(sdk, units):
    sys.path.insert(0, sdk)
    from autd3 import UdpEmulator

    emulator = UdpEmulator(units)
    print(repr(emulator.option().iface).rsplit(":", 1)[1].split('"')[0], flush=True)
    for line in sys.stdin:
        emulator.reboot(int(line))
        print(flush=True)


# SDK UNITS: prints a port, and restarts the units that are named on standard input.
# SDK UNITS INTERFACE COMMAND...: runs a command while the units are on a network.
if __name__ == "__main__":
    if len(sys.argv) == 3:
        emulate(sys.argv[1], int(sys.argv[2]))
    else:
        with Emulator(sys.argv[1], int(sys.argv[2])) as chain, Wire(chain, interface=sys.argv[3]):
            sys.exit(subprocess.run(sys.argv[4:], check=False).returncode)
