"""A sweep as a job array of a Slurm that this test starts on this machine (Debian's slurm-wlm and munge)."""

import csv
import os
import shutil
import socket
import subprocess
import sys
import time
import unittest

from support import PROGRAM, SOURCE, CommandTest
from sweep_test import TINY

MISSING = [name for name in ("slurmctld", "slurmd", "munged", "sbatch", "squeue")
           if not shutil.which(name, path=os.environ.get("PATH", "") + ":/usr/sbin:/sbin")]
if MISSING or os.geteuid() != 0:
    print(f"skipped: {'not root' if not MISSING else ', '.join(MISSING) + ' not there'}; "
          "Debian's slurm-wlm and munge, and root, let it run")
    sys.exit(77)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class SlurmTest(CommandTest):
    def setUp(self):
        super().setUp()
        self.environment = dict(os.environ, PATH=os.environ["PATH"] + ":/usr/sbin:/sbin", TOUCHFIELD=PROGRAM,
                                OMP_NUM_THREADS="1")
        self.environment["SLURM_CONF"] = str(self.folder / "slurm.conf")
        self.folder.chmod(0o755)
        key = self.folder / "munge.key"
        key.write_bytes(os.urandom(128))
        key.chmod(0o400)
        host = socket.gethostname().split(".")[0]
        (self.folder / "slurm.conf").write_text(f"""\
ClusterName=one
SlurmctldHost={host}(127.0.0.1)
AuthType=auth/munge
AuthInfo=socket={self.folder}/munge.socket
CryptoType=crypto/munge
SlurmUser=root
SlurmdUser=root
SlurmctldPort={free_port()}
SlurmdPort={free_port()}
StateSaveLocation={self.folder}/state
SlurmdSpoolDir={self.folder}/spool
SlurmctldPidFile={self.folder}/slurmctld.pid
SlurmdPidFile={self.folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
SchedulerParameters=sched_interval=1
NodeName={host} NodeAddr=127.0.0.1 CPUs={os.cpu_count()} State=UNKNOWN
PartitionName=main Nodes={host} Default=YES MaxTime=INFINITE State=UP
""")
        for name in ("state", "spool"):
            (self.folder / name).mkdir()
        self.daemons = []
        self.addCleanup(self.stop)
        self.daemon("munged", "--force", "--foreground", f"--socket={self.folder}/munge.socket",
                    f"--key-file={key}", f"--pid-file={self.folder}/munge.pid", f"--log-file={self.folder}/munge.log",
                    f"--seed-file={self.folder}/munge.seed")
        self.wait_for(lambda: (self.folder / "munge.socket").exists())
        self.daemon("slurmctld", "-D", "-f", self.folder / "slurm.conf")
        self.daemon("slurmd", "-D", "-f", self.folder / "slurm.conf")
        self.wait_for(lambda: self.slurm("sinfo", "-h", "-o", "%T").stdout.strip() in ("idle", "mixed"))

    def daemon(self, *command):
        log = open(self.folder / f"{command[0]}.out", "w")  # closed with the test
        self.addCleanup(log.close)
        self.daemons.append(subprocess.Popen([str(word) for word in command], env=self.environment, stdout=log,
                                             stderr=subprocess.STDOUT))

    def stop(self):
        for daemon in reversed(self.daemons):
            daemon.terminate()
            try:
                daemon.wait(timeout=20)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()

    def slurm(self, *command):
        return subprocess.run([str(word) for word in command], cwd=self.folder, env=self.environment,
                              capture_output=True, text=True, timeout=60, check=False)

    def wait_for(self, what, seconds=60):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if what():
                return
            time.sleep(0.2)
        logs = "\n".join(f"{path.name}: {path.read_text()[-1500:]}" for path in self.folder.glob("*.out"))
        self.fail("waited in vain\n" + logs)

    def test_a_job_array_is_the_sweep(self):
        self.write("tiny.yaml", TINY)
        self.write("s.yaml", "base: tiny.yaml\ngrid: {array.level: [1, 0.9, 0.8, 0.7, 0.6]}\n")
        self.run_ok("sweep", "s.yaml", "-o", "whole", "--quiet")
        done = self.slurm("sbatch", "--array=1-5%2", "--cpus-per-task=1", f"--output={self.folder}/job-%a.out",
                          SOURCE / "scripts/sweep.slurm", "s.yaml", "parts", "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.wait_for(lambda: not self.slurm("squeue", "-h").stdout.strip(), 180)
        said = "".join(path.read_text() for path in self.folder.glob("job-*.out"))
        said += self.run_ok("sweep", "s.yaml", "-o", "parts", "--json").stdout
        self.assertIn('"computed":0', said)

        def rows(name):
            with open(self.folder / name / "sweep.csv", newline="") as file:
                return [(row["case"], row["array.level"], row["name"], float(row["relative_error"]))
                        for row in csv.DictReader(file)]

        self.assertEqual(len(rows("whole")), 10, said)
        for one, other in zip(rows("whole"), rows("parts")):
            self.assertEqual(one[:3], other[:3], said)
            self.assertAlmostEqual(one[3], other[3], delta=1e-8)  # as the same cases in one process and in another
        self.assertEqual(len(rows("parts")), 10, said)


if __name__ == "__main__":
    unittest.main()
