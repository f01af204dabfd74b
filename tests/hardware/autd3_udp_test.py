"""Solved patterns on their way to AUTD3 units of firmware 0.10 and later, through the emulator of the vendor's SDK and a
wire to it that keeps, loses and reorders datagrams."""

import contextlib
import itertools
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "cli"))

import numpy  # noqa: E402
from autd3_units import Emulator, Observer, Wire, sdk_of  # noqa: E402
from support import PROGRAM, SOURCE, CommandTest, open_run, unittest  # noqa: E402

SDK = sdk_of(SOURCE)
OLDER_SDK = sdk_of(SOURCE, "0.11")
UNITS = 6
PER_UNIT = 249
# A mesh as coarse as it may be: it is the way of the phases that counts, not their worth.
CHANGES = ["body.edge_mm=6", "solve.allow_coarse_mesh=true", "evaluation=null", "field=[]", "write=[h5]", "solve.iterations=3", "solve.methods=[unscattered, surface]"]
SCENES = ["width_5mm", "width_8mm", "width_11mm"]
PATTERN = bytes([0x16, 0, 0, 0, 0, 0, 0xFF, 0, 0, 0, 0, 0, 0, 0, 0])  # at once, bank 0
SILENT = PATTERN + bytes(2 * PER_UNIT)
NETWORK = ["unshare", "-rn", "sh", "-c",
           "ip link set lo up && ip link add host0 type veth peer name units0 && ip link set host0 up && ip link set units0 up && sleep 3 && exec \"$@\"", "sh"]


def bodies(run, method, level):
    """What each unit is sent for a pattern, from what the run holds."""
    phases = numpy.floor(run[f"methods/{method}/phase"][:] * 256 / (2 * numpy.pi) + 0.5).astype(int) % 256
    intensities = numpy.floor(level * run[f"methods/{method}/amplitude"][:] * 255).astype(int)
    parts = [numpy.concatenate([phases[at : at + PER_UNIT], intensities[at : at + PER_UNIT]]) for at in range(0, len(phases), PER_UNIT)]
    return [PATTERN + part.astype(numpy.uint8).tobytes() for part in parts]


class Autd3UdpTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        cls.solved = pathlib.Path(tempfile.mkdtemp(prefix="touchfield-autd3-udp-"))
        cls.addClassCleanup(shutil.rmtree, cls.solved, ignore_errors=True)
        for scene in SCENES:
            command = [PROGRAM, "run", SOURCE / f"scenes/autd3/{scene}.yaml", "-o", cls.solved / scene, "--quiet"]
            for change in CHANGES:
                command += ["--set", change]
            subprocess.run(command, check=True, timeout=500, capture_output=True)

    def bodies(self, scene, method="surface", level=0.5):
        with open_run(self.solved / scene) as run:
            return bodies(run, method, level)

    def send(self, scenes, port, *arguments, method="surface"):
        return self.touchfield("send", *(self.solved / scene for scene in scenes), "--method", method, "--to", f"autd3-udp:[::1]:{port}", "--emit",
                               *arguments)

    def sent(self, scenes, port, *arguments, method="surface"):
        done = self.send(scenes, port, "--json", *arguments, method=method)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def fails(self, scenes, port, *arguments, code=4):
        done = self.send(scenes, port, *arguments)
        self.assertEqual(done.returncode, code, done.stderr + done.stdout)
        return done.stderr

    def wait_for(self, look, seconds=10):
        """What `look` finds once it is not None."""
        end = time.monotonic() + seconds
        while (found := look()) is None:
            self.assertLess(time.monotonic(), end, "nothing came")
            time.sleep(0.002)
        return found

    @staticmethod
    def all_confirmed(wire, wanted, since=0.0, units=range(UNITS)):
        """When the last of the units has confirmed its own of these bodies; None if one has not."""
        times = [wire.confirmed(unit, wanted[unit] if isinstance(wanted, list) else wanted, since) for unit in units]
        return None if None in times else max(times)

    @contextlib.contextmanager
    def emitting(self, wire, seconds=9):
        """A program that holds a pattern on all units, with its guard."""
        command = [PROGRAM, "send", self.solved / "width_8mm", "--method", "surface", "--to", f"autd3-udp:[::1]:{wire.port}", "--emit", "--seconds", str(seconds)]
        with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True) as sending:
            wanted = self.bodies("width_8mm")
            self.wait_for(lambda: self.all_confirmed(wire, wanted))
            yield sending, {"program": sending.pid, "guard": self.child_of(sending.pid)}

    @staticmethod
    def child_of(process):
        return int(pathlib.Path(f"/proc/{process}/task/{process}/children").read_text())

    def test_every_byte_reaches_six_units(self):
        for scene in SCENES:
            for method in ("unscattered", "surface"):
                with self.subTest(scene=scene, method=method), Emulator(SDK, UNITS) as emulator, Wire(emulator) as wire:
                    report = self.sent([scene], wire.port, "--level", "0.4", "--seconds", "0.2", method=method)
                    self.assertEqual((report["transducers"], report["sent"]), (UNITS * PER_UNIT, 1))
                    self.assertEqual([unit for unit in range(UNITS) if wire.commands(unit)], list(range(UNITS)))
                    for unit, body in enumerate(self.bodies(scene, method, 0.4)):
                        patterns = [data for _, data in wire.commands(unit) if data.startswith(PATTERN)]
                        self.assertEqual(patterns, [body, SILENT])

    def test_a_sequence_and_its_modulation(self):
        sine = numpy.sin(2 * numpy.pi * numpy.arange(20) / 20)
        samples = numpy.round(255 * (1 + sine) / 2).astype(numpy.uint8).tobytes()
        with Emulator(SDK, UNITS) as emulator, Wire(emulator) as wire:
            self.sent(SCENES, wire.port, "--rate", "50", "--modulation", "200")
            frames = [self.bodies(scene) for scene in SCENES]
            for unit in range(UNITS):
                data = [data for _, data in wire.commands(unit)]
                self.assertIn(bytes([0x20, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]) + samples, data)
                self.assertEqual([one for one in data if one.startswith(PATTERN)], [frame[unit] for frame in frames] + [SILENT])

    def test_a_stored_sequence(self):
        for sdk in (SDK, OLDER_SDK):
            before = bytes(4) if sdk == SDK else b""  # the time of execution
            with self.subTest(sdk=sdk.name), Emulator(sdk, UNITS) as emulator, Wire(emulator) as wire:
                start = time.monotonic()
                report = self.sent(SCENES, wire.port, "--stored", "--rate", "1000", "--seconds", "0.7")
                self.assertEqual((report["sent"], report["silent"]), (3, True))
                frames = [self.bodies(scene) for scene in SCENES]
                for unit in range(UNITS):
                    data = [data for _, data in wire.commands(unit, start)]
                    drives = [frame[unit][len(PATTERN) :] for frame in frames]
                    first = data.index(bytes([0x15]) + before + bytes([1, 2, 0, 0]) + drives[0] + drives[1])
                    wanted = [bytes([0x15]) + before + bytes([1, 1, 2, 0]) + drives[2],
                              bytes([0x11]) + before + bytes.fromhex("01012800 03000000 00000000 ffff"),  # 40 periods, 3 frames, for ever
                              bytes([0x12]) + before + bytes.fromhex("01ff0000000000000000")]
                    self.assertEqual(data[first + 1 : first + 4], wanted)
                    self.assertGreater(sum(one[0] == 0xE7 for one in data), 5)  # it is looked after meanwhile
        with Emulator(SDK, UNITS) as emulator:
            self.assertIn("40000 Hz divided by a whole number", self.fails(SCENES, emulator.port, "--stored", "--rate", "999", code=2))
            self.assertIn("from 40 to 65535", self.fails(SCENES, emulator.port, "--stored", "--rate", "2000", code=2))
            self.assertIn("stores 2 to 1024 frames, not 1", self.fails(SCENES[:1], emulator.port, "--stored", code=2))

    def test_loss_repetition_and_disorder_on_the_wire(self):
        for seed in range(3):
            with self.subTest(seed=seed), Emulator(SDK, UNITS) as emulator, \
                    Wire(emulator, seed=seed, lost=0.05, delayed=0.1, repeated=0.1) as wire, Observer(emulator) as observer:
                report = self.sent(SCENES, wire.port, "--rate", "15", "--seconds", "2", "--repeat")
                self.assertEqual(report["sent"], 30)
                frames = [self.bodies(scene) for scene in SCENES]
                observer.ask(("::1", emulator.port), 1, b"", UNITS)
                for unit in range(UNITS):
                    # A frame has a second message if a late copy of the reset came in between.
                    patterns = [body for body, _ in itertools.groupby(data for _, data in wire.commands(unit) if data.startswith(PATTERN))]
                    self.assertEqual(patterns, [frames[k % 3][unit] for k in range(30)] + [SILENT])
                    # `clear`, the start of the clock, smoothing, modulation (3), 30 frames and the silent frame; and looks.
                    counters = observer.counters(unit)
                    self.assertGreater(counters["executed"], 37)
                    self.assertEqual(counters["refused"], 0)

    def test_a_unit_that_restarts(self):
        with Emulator(SDK, UNITS) as emulator, Wire(emulator) as wire, self.emitting(wire) as (sending, _):
            start = time.monotonic()
            emulator.reboot(2)
            # Those before it in the chain: the others cannot be reached any more.
            silent = self.wait_for(lambda: self.all_confirmed(wire, SILENT, start, units=[0, 1]))
            self.assertLess(silent - start, 0.35)  # found by a look every 50 ms and a wait of 80 ms
            self.assertEqual(sending.wait(10), 4)
            said = sending.stderr.read()
            self.assertIn("units 2, 3, 4, 5 do not answer: a unit has restarted", said)
            self.assertIn("switches off after 0.5 s", said)

    def test_another_program_begins_a_sequence(self):
        """One that leaves numbers and clocks as they are."""
        with Emulator(SDK, UNITS) as emulator, Wire(emulator) as wire, self.emitting(wire) as (sending, _), Observer(emulator) as observer:
            start = time.monotonic()
            observer.read(3, 0xE7)
            self.assertEqual(sending.wait(10), 4)
            self.assertLess(time.monotonic() - start, 1)
            said = sending.stderr.read()
            self.assertIn("another program drives these units; the array could not be silenced", said)
            self.assertNotIn("the array is silent", said)
            self.assertEqual([data for _, data in wire.commands(3, start) if data.startswith(PATTERN)], [], "it disturbs the other")

    def test_units_that_hear_nothing(self):
        with Emulator(SDK, UNITS) as emulator, Wire(emulator) as wire, self.emitting(wire) as (sending, processes):
            start = time.monotonic()
            for process in processes.values():
                os.kill(process, signal.SIGKILL)
            sending.wait(10)
            time.sleep(0.6 - (time.monotonic() - start))
            with Observer(emulator) as observer:
                self.assertEqual([observer.switched_off(unit) for unit in range(UNITS)], [True] * UNITS)
                self.assertEqual([observer.counters(unit)["failsafe"] for unit in range(UNITS)], [1] * UNITS)
            self.assertIsNone(self.all_confirmed(wire, SILENT))

    def test_a_link_that_was_interrupted_does_not_resume(self):
        with Emulator(SDK, UNITS) as emulator, Wire(emulator) as wire, self.emitting(wire) as (sending, _):
            wire.lost = 1
            self.assertEqual(sending.wait(10), 4)
            wire.lost = 0
            with Observer(emulator) as observer:
                time.sleep(0.3)
                self.assertTrue(all(observer.switched_off(unit) for unit in range(UNITS)))

    def test_whatever_ends_it_leaves_a_silent_array(self):
        for signal_sent, to, code in ((signal.SIGINT, "program", 130), (signal.SIGTERM, "program", 143), (signal.SIGKILL, "program", -9),
                                      (signal.SIGSTOP, "program", 4), (signal.SIGTERM, "guard", 4), (signal.SIGSTOP, "guard", 4),
                                      (signal.SIGKILL, "guard", 4)):
            with self.subTest(signal=signal_sent.name, to=to), Emulator(SDK, UNITS) as emulator, Wire(emulator) as wire, \
                    self.emitting(wire) as (sending, processes):
                self.assertIsNone(self.all_confirmed(wire, SILENT))
                start = time.monotonic()
                os.kill(processes[to], signal_sent)
                silent = self.wait_for(lambda: self.all_confirmed(wire, SILENT, start))
                self.assertLess(silent - start, 0.4 if signal_sent == signal.SIGSTOP else 0.2)
                sending.send_signal(signal.SIGCONT)
                self.assertEqual(sending.wait(10), code)

    def test_a_firmware_that_is_not_known(self):
        def protocol(data):  # of a version to come: it refuses ours, and tells about itself in its own
            return bytes([9]) + (data[1:4] + b"\1" if asked["version"] != 9 else data[1:9] + bytes([0, 13, 1]) + data[12:])

        asked = {}

        class Newer(Wire):
            def to_unit(self, data, one, host):
                asked["version"] = data[0]
                super().to_unit(bytes([3]) + data[1:], one, host)

        with Emulator(SDK, 1) as emulator, Newer(emulator, change=protocol) as wire:
            self.assertIn("a unit has firmware 0.13.1, with version 9 of the protocol", self.fails(["width_8mm"], wire.port))

        def firmware(data):
            return data[:16] + bytes([0, 13, 1]) + data[19:] if data[1] == 0 and len(data) == 24 else data

        with Emulator(SDK, UNITS) as emulator, Wire(emulator, change=firmware) as wire:
            self.assertIn("unit 0 has firmware 0.13.1 (gates 0.12.0)", self.fails(["width_8mm"], wire.port))
            self.assertFalse([data for _, data in wire.commands(0) if data.startswith(PATTERN)])

    def test_another_number_of_units(self):
        with Emulator(SDK, UNITS - 1) as emulator:
            self.assertIn("5 of 6 units were found", self.fails(["width_8mm"], emulator.port))
        with Emulator(SDK, UNITS + 1) as emulator:
            self.assertIn("has more units than the 6 of the run", self.fails(["width_8mm"], emulator.port))

    def need_network(self):
        if subprocess.run([*NETWORK, "true"], capture_output=True, check=False).returncode != 0:
            self.skipTest("this machine lets nobody make a network of its own")

    def test_units_on_a_network_interface(self):
        self.need_network()
        units = [sys.executable, pathlib.Path(__file__).parent / "autd3_units.py", SDK, str(UNITS), "units0"]
        for to in ("autd3-udp", "autd3-udp:host0"):
            send = [PROGRAM, "send", self.solved / "width_8mm", "--method", "surface", "--to", to, "--emit", "--seconds", "0.2", "--json"]
            done = subprocess.run([*NETWORK, *units, *send], capture_output=True, text=True, timeout=60, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIs(json.loads(done.stdout)["silent"], True)

    def test_nobody_answers(self):
        self.need_network()
        with Emulator(SDK, 1) as emulator:
            port = emulator.port
        self.assertIn(f"no unit answers on [::1] port {port}", self.fails(["width_8mm"], port))
        self.is_refused("array", "off", "--to", "autd3-udp:lo", code=4, says="no link-local IPv6 address on lo; connect the units")
        for to in ("autd3-udp", "autd3-udp:units0"):
            done = subprocess.run([*NETWORK, PROGRAM, "array", "off", "--to", to], capture_output=True, text=True, timeout=60, check=False)
            self.assertEqual(done.returncode, 4, done.stderr)
            self.assertRegex(done.stderr, "no unit answers on the network interfaces? " + ("(host0, units0|units0, host0)" if to == "autd3-udp" else "units0")
                             + "; check the cable, the supply of the units, and that the firewall lets UDP port 44336 through")

    def test_nothing_is_sent_without_leave(self):
        with Emulator(SDK, UNITS) as emulator, Wire(emulator) as wire:
            done = self.touchfield("send", self.solved / "width_8mm", "--method", "surface", "--to", f"autd3-udp:[::1]:{wire.port}")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.fails(["width_8mm"], wire.port, "--level", "0.6", code=2)
            self.fails(["width_8mm"], wire.port, "--rate", "801", code=2)
            self.fails(["width_8mm"], wire.port, "--modulation", "3000", code=2)
            self.assertEqual(wire.datagrams, [])

    def test_the_kept_bytes_are_those_of_the_sdk(self):
        script = SOURCE / "tests/hardware/autd3_udp_vectors.py"
        made = [subprocess.run([sys.executable, script, sdk], check=True, capture_output=True, text=True, timeout=60).stdout for sdk in (OLDER_SDK, SDK)]
        self.assertEqual("".join(made), (SOURCE / "tests/data/autd3_udp_commands.txt").read_text())


if __name__ == "__main__":
    unittest.main()
