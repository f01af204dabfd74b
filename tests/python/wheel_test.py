"""The wheels of scripts/wheel in a bare Debian 12 without compiler, libraries and fonts, and beside others' modules."""

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
# Modules with some of the same libraries, and what loads them.
OTHERS = {
    "h5py": "h5py.File('beside.h5', 'w')['x'] = 1",
    "matplotlib.pyplot": "matplotlib.pyplot.plot([1]); matplotlib.pyplot.savefig('beside.pdf')",
    "scipy.linalg": "scipy.linalg.lu_factor([[1, 2], [3, 4]])",
    "ssl": "ssl.create_default_context()",
    "torch": "torch.ones(100, 100) @ torch.ones(100, 100)",
    "vtk": "s = vtk.vtkSphereSource(); w = vtk.vtkXMLPolyDataWriter(); w.SetInputConnection(s.GetOutputPort()); "
           "w.SetFileName('beside.vtp'); w.Write()",
}
OWN = "print(touchfield.run('quick.yaml', set={'solve.iterations': 3}).metrics['surface']['relative_error'])"


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
        run(ROOT / "scripts/wheel", cls.folder / "wheels")
        cls.wheels = sorted((cls.folder / "wheels").glob("*.whl"))
        cls.package, cls.program = cls.wheels
        cls.bare = cls.folder / "bare"
        run("debootstrap", "--variant=minbase", "--include=python3-venv", "bookworm", cls.bare, "http://deb.debian.org/debian")
        work = cls.bare / "work"
        (work / "scenes").mkdir(parents=True)
        for file in cls.wheels:
            shutil.copy(file, work)
        shutil.copy(ROOT / "scenes/quick.yaml", work / "scenes")
        run(ROOT / "build/python/bin/python", "-m", "pip", "download", "--quiet", "--no-deps", "--only-binary=:all:", "--dest", work, "numpy")

    def inside(self, command):
        """A shell's output in the bare system, without the network and with what mounts end with it."""
        script = f'mount -t proc proc {self.bare}/proc && exec chroot {self.bare} env -i PATH=/usr/bin:/bin HOME=/root sh -c "cd /work; $0"'
        return run("unshare", "--mount", "--net", "sh", "-ec", script, command)

    def test_libraries_and_licences(self):
        for file in self.wheels:
            self.assertLess(file.stat().st_size, 70e6)
            with zipfile.ZipFile(file) as archive:
                names = archive.namelist()
                share = "touchfield_program/share/licences"
                packages = dict(line.split("\t") for line in archive.read(f"{share}/FILES").decode().splitlines())
            for name in names:
                if match := re.fullmatch(r"touchfield_program/lib/(.*)-[0-9a-f]{8}(\.so.*)", name):
                    package = packages["".join(match.groups())]
                    self.assertIn(package, LICENCES, f"read the licence of {package}")
                    self.assertIn(f"{share}/{package}", names)
                else:
                    self.assertNotRegex(name, r"/lib/(?!libtouchfield)", name)

    def test_package_in_a_bare_system(self):
        for path in ["usr/bin/gcc", "usr/share/fonts", "usr/lib/x86_64-linux-gnu/libgomp.so.1"]:
            self.assertFalse((self.bare / path).exists(), path)
        lines = re.search(r"```python\n(import touchfield.*?)```", (ROOT / "README.md").read_text(), re.S)[1]
        (self.bare / "work/six.py").write_text(lines)
        self.inside("python3 -m venv v")
        start = time.monotonic()
        self.inside(f"v/bin/pip install --quiet --no-index --find-links . ./{self.package.name}")
        print(f"pip install: {time.monotonic() - start:.1f} s", file=sys.stderr)
        self.inside("v/bin/python six.py")
        print(f"and a first picture: {time.monotonic() - start:.1f} s", file=sys.stderr)
        self.inside("v/bin/touchfield run scenes/quick.yaml -o ran --set target.pressure_pa=3000 --quiet")
        work = self.bare / "work"
        pictures = sorted(path.name for path in (work / "ran").rglob("*.png"))
        self.assertIn("overview.png", pictures)
        for name in pictures:  # in the same font
            first, second = ((work / run / name).read_bytes().partition(b"IDAT")[2] for run in ["ran", "quick_3000"])
            self.assertTrue(first and first == second, name)
        self.assertIn("text in DejaVu Sans", self.inside("v/bin/touchfield doctor"))

    def test_program_alone_in_a_bare_system(self):
        self.inside("python3 -m venv p")
        self.inside(f"p/bin/pip install --quiet --no-index ./{self.program.name}")
        self.assertIn("text in DejaVu Sans", self.inside("p/bin/touchfield doctor"))
        self.inside("p/bin/touchfield run scenes/quick.yaml -o alone --quiet")

    def test_beside_others(self):
        run("/usr/bin/python3", "-m", "venv", "--system-site-packages", self.folder / "others")
        python = self.folder / "others/bin/python"
        run(python, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps", self.package)
        shutil.copy(ROOT / "scenes/quick.yaml", self.folder)
        alone = run(python, "-c", f"import touchfield; {OWN}", cwd=self.folder)
        for other, use in OTHERS.items():
            if subprocess.run([python, "-c", f"import {other}"], capture_output=True, check=False).returncode != 0:
                print(f"not beside {other}, which is not installed", file=sys.stderr)
                continue
            for lines in [f"import touchfield, {other}; {use}; {OWN}", f"import {other}, touchfield; {OWN}; {use}"]:
                self.assertEqual(run(python, "-c", lines, cwd=self.folder), alone, lines)


if __name__ == "__main__":
    if os.geteuid() != 0 or not shutil.which("debootstrap") or not shutil.which("unshare"):
        print("a bare system is made by debootstrap, as root: one of them is missing")
        sys.exit(SKIPPED)
    if not (ROOT / "build/python/bin/python").exists():
        print("no build/python: scripts/setup_python makes it")
        sys.exit(SKIPPED)
    unittest.main()
