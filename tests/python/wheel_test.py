"""The wheel of scripts/wheel in bare systems without compiler, libraries and fonts, and beside others' modules."""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
import zipfile

ROOT = pathlib.Path(os.environ["TOUCHFIELD_SOURCE_DIR"])
SKIPPED = 77
# Under what the libraries of these Debian packages come, as read in their copyright files; of those under two licences the
# one that is taken. Some of these files name the GPL too: for the packages' scripts, programs and tests. Two leave the
# library out: libcom-err2 is as its sources say (lib/et), libidn2-0 as its README.md.
LICENCES = {
    "fonts-dejavu-core": "Bitstream Vera", "libaec0": "BSD-2-Clause", "libbrotli1": "MIT", "libbsd0": "BSD-3-Clause",
    "libcairo2": "MPL-1.1, or LGPL-2.1", "libcom-err2": "MIT", "libcurl4": "curl", "libdouble-conversion3": "BSD-3-Clause",
    "libexpat1": "MIT", "libffi8": "MIT", "libfmt9": "MIT", "libfontconfig1": "MIT", "libfreetype6": "FTL",
    "libgfortran5": "GPL-3 with the GCC runtime exception", "libgcc-s1": "GPL-3 with the GCC runtime exception",
    "libgmp10": "LGPL-3", "libgnutls30": "LGPL-2.1", "libgomp1": "GPL-3 with the GCC runtime exception",
    "libgssapi-krb5-2": "MIT", "libhdf5-103-1": "BSD-3-Clause", "libhogweed6": "LGPL-3", "libidn2-0": "LGPL-3",
    "libk5crypto3": "MIT", "libkeyutils1": "LGPL-2", "libkrb5-3": "MIT", "libkrb5support0": "MIT",
    "libldap-2.5-0": "OpenLDAP-2.8", "liblz4-1": "BSD-2-Clause", "liblzma5": "public domain", "libmd0": "BSD-3-Clause",
    "libnettle8": "LGPL-3", "libnghttp2-14": "MIT", "libopenblas0-openmp": "BSD-3-Clause", "libp11-kit0": "BSD-3-Clause",
    "libpixman-1-0": "MIT", "libpng16-16": "libpng", "libpsl5": "MIT", "libquadmath0": "LGPL-2", "librtmp1": "LGPL-2.1",
    "libsasl2-2": "BSD-4-Clause of Carnegie Mellon", "libspng0": "BSD-2-Clause", "libssh2-1": "BSD-3-Clause",
    "libssl3": "Apache-2.0", "libstdc++6": "GPL-3 with the GCC runtime exception", "libsz2": "BSD-2-Clause",
    "libtasn1-6": "LGPL-2.1", "libtbb12": "Apache-2.0", "libunistring2": "LGPL-3", "libvtk9.1": "BSD-3-Clause",
    "libx11-6": "MIT", "libxau6": "MIT", "libxcb-render0": "MIT", "libxcb-shm0": "MIT", "libxcb1": "MIT", "libxdmcp6": "MIT",
    "libxext6": "MIT", "libxrender1": "MIT", "libyaml-cpp0.7": "MIT", "libzstd1": "BSD-3-Clause", "zlib1g": "Zlib",
}
# Modules with some of the same libraries, and what uses them: it prints the same with touchfield in the process.
OTHERS = {
    "h5py": "h5py.File('beside.h5', 'w')['x'] = 1",
    "matplotlib.pyplot": "matplotlib.pyplot.plot([1]); matplotlib.pyplot.savefig('beside.pdf')",
    "scipy.linalg": "print(scipy.linalg.svdvals(scipy.linalg.hilbert(300)).sum())",
    "sklearn.cluster": "print(sklearn.cluster.KMeans(2, n_init=1).fit([[i % 2, 0] for i in range(5000)]).inertia_)",
    "ssl": "ssl.create_default_context()",
    "torch": "a = torch.arange(90000.0).reshape(300, 300).sin(); print(torch.get_num_threads(), (a @ a).sum().item())",
    "vtk": "s = vtk.vtkSphereSource(); w = vtk.vtkXMLPolyDataWriter(); w.SetInputConnection(s.GetOutputPort()); "
           "w.SetFileName('beside.vtp'); w.Write()",
}
OWN = "print(touchfield.run('quick.yaml', set={'solve.iterations': 3}).metrics['surface']['relative_error'])"
# Mirror, and what debootstrap of Debian 12 has to be told of a system that it does not know.
SYSTEMS = {"bookworm": ["http://deb.debian.org/debian"], "trixie": ["http://deb.debian.org/debian"],
           "noble": ["http://archive.ubuntu.com/ubuntu", "gutsy", "--components=main,universe", "--no-check-gpg"]}
PYENV = pathlib.Path.home() / ".pyenv/versions"  # other Pythons, if it has some


def run(*command, **options):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=900, check=False, **options)
    if done.returncode != 0:
        raise AssertionError(f"{command}: {done.returncode}\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}")
    return done.stdout


class Wheel(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="touchfield-wheel-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        run(ROOT / "scripts/wheel", cls.folder / "made")
        cls.wheel, = (cls.folder / "made").glob("*.whl")
        for suite, (mirror, *options) in SYSTEMS.items():
            script, options = options[:1], options[1:]
            run("debootstrap", "--variant=minbase", "--include=python3-venv", *options, suite, cls.folder / suite, mirror, *script)
            (cls.folder / suite / "work/scenes").mkdir(parents=True)
            shutil.copy(ROOT / "scenes/quick.yaml", cls.folder / suite / "work/scenes")
            shutil.copy(cls.wheel, cls.folder / suite)

    def inside(self, suite, command):
        """A shell's output in a bare system, without the network and with what mounts end with it."""
        root = self.folder / suite
        mounts = [f"mount -t proc proc {root}/proc"]
        if PYENV.exists():
            mounts.append(f"mkdir -p {root}{PYENV} && mount --bind {PYENV} {root}{PYENV}")
        pip = "PIP_NO_INDEX=1 PIP_FIND_LINKS=/work"
        script = f'{" && ".join(mounts)} && exec chroot {root} env -i PATH=/usr/bin:/bin HOME=/root {pip} sh -c "cd /work; $0"'
        return run("unshare", "--mount", "--net", "sh", "-ec", script, command)

    def fetch_for(self, suite, python):
        """What the wheel needs, as pip would."""
        version = self.inside(suite, f"{python} -V").split()[1]
        run(ROOT / "build/python/bin/python", "-m", "pip", "download", "--quiet", "--no-deps", "--only-binary=:all:",
            "--python-version", version, "--dest", self.folder / suite / "work", "numpy", "nanobind-backend")

    def test_libraries_and_licences(self):
        self.assertIn("-cp310-abi3-manylinux_2_36_x86_64", self.wheel.name)
        self.assertLess(self.wheel.stat().st_size, 50e6)
        with zipfile.ZipFile(self.wheel) as archive:
            names = [name for name in archive.namelist() if not name.endswith("/")]
            share = "touchfield_program/share/licences"
            packages = dict(line.split("\t") for line in archive.read(f"{share}/FILES").decode().splitlines())
        for name in names:
            if match := re.fullmatch(r"touchfield_program/lib/(.*)-[0-9a-f]{8}(\.so.*)", name):
                package = packages["".join(match.groups())]
                self.assertIn(package, LICENCES, f"read the licence of {package}")
                self.assertIn(f"{share}/{package}", names)
            else:
                self.assertNotRegex(name, r"/lib/(?!(touchfield/)?libtouchfield)", name)

    def test_package_in_bare_systems(self):
        lines = re.search(r"```python\n(import touchfield.*?)```", (ROOT / "README.md").read_text(), re.S)[1]
        others = sorted(PYENV.glob("3.1?.*/bin/python3"))
        for suite, python in [(suite, "python3") for suite in SYSTEMS] + [("bookworm", path) for path in others]:
            with self.subTest(suite=suite, python=python):
                work = self.folder / suite / "work"
                for path in ["usr/bin/gcc", "usr/share/fonts", "usr/lib/x86_64-linux-gnu/libgomp.so.1"]:
                    self.assertFalse((self.folder / suite / path).exists(), path)
                (work / "six.py").write_text(lines)
                self.fetch_for(suite, python)
                self.inside(suite, f"rm -rf v ran quick_3000 && {python} -m venv v")
                start = time.monotonic()
                self.inside(suite, "v/bin/pip install --quiet /touchfield-*.whl")
                installed = time.monotonic() - start
                self.inside(suite, "v/bin/python six.py")
                seconds = time.monotonic() - start
                print(f"{suite}, {python}: pip install in {installed:.1f} s, the first picture after {seconds:.1f} s", file=sys.stderr)
                self.inside(suite, "v/bin/touchfield run scenes/quick.yaml -o ran --set target.pressure_pa=3000 --quiet")
                pictures = sorted(path.name for path in (work / "ran").rglob("*.png"))
                self.assertIn("overview.png", pictures)
                for name in pictures:  # in the same font
                    first, second = ((work / folder / name).read_bytes().partition(b"IDAT")[2] for folder in ["ran", "quick_3000"])
                    self.assertTrue(first and first == second, name)
                self.assertIn("text in DejaVu Sans", self.inside(suite, "v/bin/touchfield doctor"))

    def test_steps_of_the_recipes(self):
        container, apptainer = ((self.folder / "made" / name).read_text() for name in ["Containerfile", "apptainer.def"])
        steps = re.findall(r"^RUN (.*)", container, re.M)
        self.assertEqual(apptainer.partition("%post\n")[2].partition("\n\n")[0].splitlines(), steps)
        self.fetch_for("bookworm", "python3")
        for step in steps:  # apt finds no network and all installed
            self.inside("bookworm", step)
        command = " ".join(json.loads(re.search(r"^ENTRYPOINT (.*)", container, re.M)[1]))
        self.assertIn(f"exec {command} ", apptainer)
        self.assertIn("text in DejaVu Sans", self.inside("bookworm", f"{command} doctor"))

    def test_beside_others(self):
        """Debian's modules and pip's, of two threads each."""
        environment = {**os.environ, "OMP_NUM_THREADS": "2"}
        shutil.copy(ROOT / "scenes/quick.yaml", self.folder)
        for name, place in {"debian": "/usr/lib/python3/dist-packages", "pip": next(ROOT.glob("build/python/lib/*/site-packages"))}.items():
            run("/usr/bin/python3", "-m", "venv", self.folder / name)
            python = self.folder / name / "bin/python"
            run(python, "-m", "pip", "install", "--quiet", "--no-deps", self.wheel, "nanobind-backend")
            next(self.folder.glob(f"{name}/lib/*/site-packages")).joinpath("others.pth").write_text(f"{place}\n")
            alone = run(python, "-c", f"import touchfield; {OWN}", cwd=self.folder, env=environment)
            for other, use in OTHERS.items():
                if subprocess.run([python, "-c", f"import {other}"], capture_output=True, check=False).returncode != 0:
                    print(f"not beside {other} of {name}, which is not installed", file=sys.stderr)
                    continue
                said = run(python, "-c", f"import {other}; {use}", cwd=self.folder, env=environment)
                for lines, expected in [(f"import touchfield, {other}; {use}; {OWN}", said + alone),
                                        (f"import {other}, touchfield; {OWN}; {use}", alone + said)]:
                    self.assertEqual(run(python, "-c", lines, cwd=self.folder, env=environment), expected, lines)


if __name__ == "__main__":
    if os.geteuid() != 0 or not shutil.which("debootstrap") or not shutil.which("unshare"):
        print("a bare system is made by debootstrap, as root: one of them is missing")
        sys.exit(SKIPPED)
    if not (ROOT / "build/python/bin/python").exists():
        print("no build/python: scripts/setup_python makes it")
        sys.exit(SKIPPED)
    unittest.main()
