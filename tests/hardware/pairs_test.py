"""Ordered pairs of signals, stops and kills to a program and its guard, with a random time between them, while a board is on.

usage: pairs_test.py [COUNT [SEED]]   default: 30 pairs, seed 1. As many dry runs, of which the program is the only process, as a tenth of
that. Prints how long the array stayed on: after a kill or a signal, after a stop, where both processes failed, and after each signal alone.
"""

import os
import random
import signal
import subprocess
import sys
import time
import unittest

import sonicsurface_test
from live_test import SCENE
from sonicsurface_test import PROGRAM, SILENT_AFTER_STOP, SILENT_WITHIN

COUNT, SEED = 30, 1
SIGNALS = [signal.SIGINT, signal.SIGTERM, signal.SIGSTOP, signal.SIGKILL]
HARD = (signal.SIGSTOP, signal.SIGKILL)
LONGEST_GAP = 0.4  # s between the two
SWING = SCENE.replace("[surface, {", "[{").replace("seconds: 2", "seconds: 9").replace("frames_hz: 10", "frames_hz: 20")


class Pairs(sonicsurface_test.Emission):
    def pairs(self, count, who):
        chance = random.Random(SEED)
        for number in range(count):
            pair = [(chance.choice(who), chance.choice(SIGNALS)) for _ in range(2)]
            gap = chance.choice([0, chance.uniform(0, 0.03), chance.uniform(0, LONGEST_GAP)])
            text = f"pair {number} of seed {SEED}: " + f", {1e3 * gap:.1f} ms, ".join(f"{which} {what.name}" for which, what in pair)
            with self.subTest(text):
                yield pair, gap, text

    @staticmethod
    def signalled(pair, gap, processes):
        """When each was sent."""
        times = []
        for (who, number) in pair:
            times.append(time.monotonic())
            try:
                os.kill(processes[who], number)
            except ProcessLookupError:
                pass
            if len(times) == 1:
                time.sleep(gap)
        return times

    def test_a_board(self):
        worst = {"kill or signal": (0, ""), "stop": (0, ""), "both failed": (0, "")}
        alone = {}  # what -> times, of those that were alone
        still_on = 0
        for pair, gap, text in self.pairs(COUNT, ["program", "guard"]):
            board, process, guard = self.emission()
            times = self.signalled(pair, gap, {"program": process.pid, "guard": guard})
            silent = board.wait(lambda b: b.silent_at is not None, seconds=1)
            hard = {who for k, (who, number) in enumerate(pair) if number in HARD and (not silent or times[k] < board.silent_at)}
            if len(hard) == 2 and not silent:  # nobody is left, or nobody who runs
                still_on += 1
                for one in (process.pid, guard):
                    if self.runs(one):
                        os.kill(one, signal.SIGCONT)
                if pair[0][1] == pair[1][1] == signal.SIGKILL:
                    self.run_ok("array", "off", "--to", f"sonicsurface:{board.port}")
                self.assertTrue(board.wait(lambda b: b.silent_at is not None), "it is still on")
            else:
                self.assertTrue(silent, "it is still on")
                before = [k for k in range(2) if times[k] < board.silent_at]
                if before == [0]:
                    alone.setdefault(f"{pair[0][0]}: {pair[0][1].name}", []).append(1e3 * (board.silent_at - times[0]))
                # Of two the later one may have taken the first one's work away.
                kind, since = "stop", times[before[-1]]
                if len(hard) == 2:
                    kind = "both failed"
                elif all(pair[k][1] != signal.SIGSTOP for k in before):
                    kind = "kill or signal"
                worst[kind] = max(worst[kind], (board.silent_at - since, text))
                if kind != "both failed":
                    self.assertLessEqual(board.silent_at - since, SILENT_AFTER_STOP if kind == "stop" else SILENT_WITHIN)
            for one in (process.pid, guard):
                if self.runs(one):
                    os.kill(one, signal.SIGCONT)
            process.communicate(timeout=10)
            self.stays_silent(board, guard)
            self.assertEqual(board.firmware.faults, [])
            board.stop_reading()
        for kind, (seconds, text) in worst.items():
            print(f"{kind}: at most {1e3 * seconds:.0f} ms ({text})")
        for what, times in sorted(alone.items()):
            print(f"{what}, alone: median {sorted(times)[len(times) // 2]:.0f} ms, longest {max(times):.0f} ms of {len(times)}")
        print(f"on until a process continued, or until `array off`: {still_on} of {COUNT}")

    def test_a_dry_run(self):
        """It has no device and so no guard: the process ends, and each of its files is whole."""
        scene = self.write("swing.yaml", SWING)
        for pair, gap, _ in self.pairs(COUNT // 10, ["program"]):
            folder = self.folder / f"frames{time.monotonic_ns()}"
            folder.mkdir()
            process = subprocess.Popen([PROGRAM, "live", scene, "--to", f"dry-run:{folder}/f.txt", "--emit", "--quiet"], cwd=self.folder,
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            self.addCleanup(process.kill)
            end = time.monotonic() + 30
            while len(list(folder.glob("f-*.txt"))) < 3 and time.monotonic() < end:
                time.sleep(0.01)
            self.signalled(pair, gap, {"program": process.pid})
            start = time.monotonic()
            process.send_signal(signal.SIGCONT)
            if all(number == signal.SIGSTOP for _, number in pair):
                process.terminate()
            process.wait(10)
            self.assertLess(time.monotonic() - start, SILENT_AFTER_STOP)
            files = list(folder.glob("f-*.txt"))
            self.assertGreater(len(files), 2)
            self.assertEqual({len(file.read_text().splitlines()) for file in files}, {257})


if __name__ == "__main__":
    if sys.argv[1:2] and sys.argv[1].isdigit():
        COUNT = int(sys.argv.pop(1))
    if sys.argv[1:2] and sys.argv[1].isdigit():
        SEED = int(sys.argv.pop(1))
    unittest.main()
