"""touchfield mesh: any file gives a report, a closed skin, or a clear error."""

import json
import subprocess
import unittest

import h5py
import numpy

from meshes import icosphere, together, write_stl
from support import PROGRAM, CommandTest

CORNERS = numpy.array([[x, y, z] for z in (0, 100) for y in (0, 100) for x in (0, 100)], dtype=float)
CUBE = numpy.array([[0, 3, 1], [0, 2, 3], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4],
                    [2, 7, 3], [2, 6, 7], [0, 6, 2], [0, 4, 6], [1, 3, 7], [1, 7, 5]])


def read_obj(path):
    lines = [line.split() for line in path.read_text().splitlines()]
    return (numpy.array([line[1:4] for line in lines if line and line[0] == "v"], dtype=float),
            numpy.array([line[1:4] for line in lines if line and line[0] == "f"], dtype=int) - 1)


def write_obj(path, vertices, triangles):
    path.write_text("".join([*("v {} {} {}\n".format(*map(float, vertex)) for vertex in vertices),
                             *("f {} {} {}\n".format(*(triangle + 1)) for triangle in triangles)]))


def edge_lengths(vertices, triangles):
    ends = numpy.unique(numpy.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    return numpy.linalg.norm(vertices[ends[:, 1]] - vertices[ends[:, 0]], axis=1)


class Mesh(CommandTest):
    def report(self, *arguments):
        done = self.run_ok("mesh", *arguments, "--json")
        return json.loads(done.stdout)

    def refused(self, *arguments, says):
        super().refused("mesh", *arguments, says=says)

    def obj(self, vertices, triangles, name="skin.obj"):
        path = self.folder / name
        write_obj(path, numpy.asarray(vertices, dtype=float), numpy.asarray(triangles))
        return path

    def cube(self, triangles=CUBE, vertices=CORNERS):
        return self.obj(vertices, triangles)


class Inspection(Mesh):
    def test_a_good_mesh(self):
        report = self.report(self.cube(), "--unit", "mm")
        self.assertTrue(report["usable"])
        self.assertEqual(report["warnings"], [])
        self.assertIsNone(report["result"])
        surface = report["surface"]
        self.assertEqual([surface[key] for key in ("faces", "vertices", "components", "closed", "self_intersections")],
                         [12, 8, 1, True, 0])
        self.assertAlmostEqual(surface["area_cm2"], 600)
        self.assertAlmostEqual(surface["volume_cm3"], 1000)
        # The wavelength at 40 kHz and 20 C against the diagonal of a side.
        self.assertAlmostEqual(surface["epw_min"], 343.21 / 40e3 / 0.1 / 2**0.5, places=6)
        said = self.run_ok("mesh", self.cube(), "--unit", "mm").stdout
        for phrase in [r"faces +12\n", r"area +600 cm2\n", r"volume +1000 cm3\n", r"edges per wavelength mean +\d", r"wavelength +8\.58 mm\n",
                       r"usable +yes\n"]:
            self.assertRegex(said, phrase)

    def test_faults_are_said_with_place_and_count(self):
        done = self.run_ok("mesh", self.cube(CUBE[1:]), "--unit", "mm")
        self.assertRegex(done.stdout, r"faults +3 boundary edges \(1 hole of 341\.42 mm\), the first between")
        self.assertRegex(done.stdout, r"edges +length \[mm\] +at \[mm\]\n +3 +341\.4 +66\.67, 33\.33, 0\n")
        self.assertFalse(self.report(self.cube(CUBE[1:]), "--unit", "mm")["usable"])

    def test_the_unit_is_guessed_from_the_size(self):
        # 173 across.
        self.assertNotIn("warning", self.run_ok("mesh", self.cube()).stderr)
        for scale, unit, certainty in [(1, "mm", "sure"), (0.1, "mm", "unclear"), (1e-3, "m", "sure"), (1e3, "mm", "none")]:
            report = self.report(self.cube(vertices=CORNERS * scale))
            self.assertEqual((report["unit"], report["unit_guess"]["certainty"]), (unit, certainty), scale)
            self.assertEqual(len(report["warnings"]), 0 if scale == 1 else 1, scale)
        path = self.cube(vertices=CORNERS * 0.1)
        self.refused(path, "--remesh", "2", "-o", "out.stl", says=["--unit", "173 mm if in cm"])
        self.refused(path, "--resurface", "2", says="--unit")


class Work(Mesh):
    def volume(self, path, *arguments):
        report = self.report(path, *arguments)
        self.assertTrue(report["usable"], report)
        return report["surface"]["volume_cm3"]

    def test_every_format_in_and_out(self):
        path = self.cube()
        for ending in ["stl", "obj", "ply", "off"]:
            copy = self.folder / f"copy.{ending}"
            report = self.report(path, "-o", copy)
            self.assertEqual(report["written"], f"{copy} in mm")
            self.assertAlmostEqual(self.volume(copy), 1000, places=6)
            path = copy
        self.refused(path, "-o", "copy.dae", says="copy.dae")
        self.report(path, "-o", "copy.vtp")
        self.refused("copy.vtp", says="VTP is only written; save the file as PLY")

    def test_the_file_keeps_its_unit_unless_told(self):
        path = self.cube(vertices=CORNERS * 1e-3)
        self.report(path, "-o", "same.obj")
        numpy.testing.assert_allclose(read_obj(self.folder / "same.obj")[0], CORNERS * 1e-3, atol=1e-12)
        self.report(path, "--output-unit", "mm", "-o", "mm.obj")
        numpy.testing.assert_allclose(read_obj(self.folder / "mm.obj")[0], CORNERS, atol=1e-9)

    def test_a_faulty_mesh_is_written_only_as_a_new_skin(self):
        path = self.cube(CUBE[:, ::-1])
        self.refused(path, "-o", "out.ply", says=["inside out", "--resurface MM"])
        report = self.report(path, "--unit", "mm", "--resurface", "4", "-o", "out.ply")
        self.assertEqual(report["steps"][0], "turned 1 patch outwards")
        self.assertAlmostEqual(self.volume(self.folder / "out.ply"), 1000, delta=5)
        # Without -o it says what it would do.
        done = self.run_ok("mesh", path, "--unit", "mm", "--resurface", "4")
        self.assertRegex(done.stdout, "steps +turned 1 patch outwards")
        self.assertNotIn("written", done.stdout)

    def test_a_foreign_hand(self):
        vertices, triangles, _ = self.foreign()
        lengths = edge_lengths(vertices, triangles)
        self.assertLess(lengths.min(), 2)
        self.assertGreater(lengths.max(), 5)

        path = self.obj(vertices * 1e-3, triangles, "foreign.obj")
        report = self.report(path)
        self.assertEqual((report["unit"], report["unit_guess"]["certainty"]), ("m", "sure"))
        self.assertRegex(report["warnings"][0], "^unit: the file states none, this report takes m. The size fits .* 0.438 mm if in mm")
        report = self.report(path, "--remesh", "3", "-o", "remeshed.ply")
        result = report["result"]
        self.assertEqual(result["faults"], [])
        self.assertAlmostEqual(result["mean_edge_mm"], 3, delta=0.1)
        self.assertGreater(result["epw_mean"], 2.7)
        self.assertAlmostEqual(result["volume_cm3"] / report["surface"]["volume_cm3"], 1, delta=0.015)

    def test_a_width_scene_on_a_foreign_hand(self):
        vertices, triangles, pad = self.foreign()
        self.obj(vertices * 1e-3, triangles, "foreign.obj")
        scene = self.write("width.yaml", f"""\
name: foreign
array:
  grid: {{count: [20, 16], pitch_mm: 10.16}}
body:
  mesh: {{file: foreign.obj, landmarks: {{index_pad: {(pad * 1e-3).tolist()}}}}}
  place: {{landmark: index_pad, at_mm: [0, 0, 200]}}
  edge_mm: {{near_target: 2, far: 4, within_mm: 12}}
  keep_within_mm: 40
target:
  box: {{at: index_pad, size_mm: [8, 40, 6]}}
  pressure_pa: 1500
solve:
  methods: [surface, paper, unscattered, focus]
evaluation: {{edge_mm: {{near_target: 2, far: 8, within_mm: 12}}}}
write: [h5]
""")
        for command in (["check", scene], ["run", scene, "-o", "out"]):
            self.is_refused(*command, says=["foreign.obj: the unit is missing", "looks like m ", ". Set body.mesh.unit"])
        self.assertFalse((self.folder / "out").exists())
        stated = json.loads(self.run_ok("check", scene, "--json", "--set", "body.mesh.unit=m").stdout)
        self.assertEqual([w for w in stated["warnings"] if "mesh_unit" in w], [])

        self.run_ok("run", scene, "-o", "out", "--set", "body.mesh.unit=m", "--quiet")
        with h5py.File(self.folder / "out" / "run.h5") as run:
            points, corners = run["mesh/vertices"][:], run["mesh/triangles"][:]
            hit = points[corners[run["target/face"][:]]].mean(axis=1) * 1e3
            centre = run["target/boxes/centre"][0] * 1e3
            error = {name: method.attrs["relative_error"] for name, method in run["methods"].items()}
        self.assertGreater(len(hit), 50)
        self.assertTrue((numpy.abs(hit - centre) < [5.3, 21.3, 4.3]).all())  # of faces on the border too
        # The box is about the pad on the skin that is solved, which is meshed anew.
        self.assertLess(numpy.linalg.norm(centre - [0, 0, 200]), 1.0)
        self.assertGreater(numpy.ptp(hit[:, 0]), 6)
        lengths = edge_lengths(points * 1e3, corners[near_the_pad(points, corners)])
        self.assertLess(abs(lengths.mean() / 2 - 1), 0.1)
        self.assertLess(error["surface"], error["paper"] + 1e-3)
        self.assertLess(error["paper"], error["unscattered"])
        self.assertLess(error["unscattered"], error["focus"])

    made = []

    def foreign(self):
        """Vertices [mm], triangles and pad of a hand as others make them, coarse and uneven; it is made once."""
        if not self.made:
            said = json.loads(self.run_ok("hand", "--pose", "index_up", "--edge-mm", "4", "-o", "fine.obj", "--json").stdout)
            self.made.extend([*thinned(*read_obj(self.folder / "fine.obj")), numpy.array(said["landmarks"]["index_pad"])])
        return self.made


def thinned(vertices, triangles):
    """Every third face in three about a point near one of its corners."""
    cut = numpy.arange(0, len(triangles), 3)
    middle = len(vertices) + numpy.arange(len(cut))
    a, b, c = triangles[cut].T
    points = 0.7 * vertices[a] + 0.15 * vertices[b] + 0.15 * vertices[c]
    children = [numpy.stack(child, axis=1) for child in ([a, b, middle], [b, c, middle], [c, a, middle])]
    return numpy.concatenate([vertices, points]), numpy.concatenate([numpy.delete(triangles, cut, axis=0), *children])


def near_the_pad(points, corners):
    """Faces within 12 mm of the place of the pad."""
    return numpy.linalg.norm(points[corners].mean(axis=1) - [0, 0, 0.2], axis=1) < 0.012


class Broken(Mesh):
    """Files as they are found: exit code 2 and a clear error, or a report; never a crash."""

    def test_no_mesh_at_all(self):
        for name, content, says in [
                ("empty.stl", b"", "empty"), ("points.obj", b"v 0 0 0\nv 1 0 0\n", "no face"),
                ("half.stl", b"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0", "half.stl"),
                ("nan.obj", b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "finite"),
                ("wild.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "wild.obj"),
                ("other.dae", b"<xml/>", "other.dae")]:
            (self.folder / name).write_bytes(content)
            self.refused(name, says=[name, says])
            self.refused(name, "--unit", "mm", "--resurface", "2", "-o", "out.ply", says=name)
        self.refused("nowhere.stl", says="no such file")
        self.refused(self.folder, says="")

    def test_garbage_and_files_cut_short(self):
        noise = numpy.random.default_rng(1).integers(0, 256, 3000, dtype=numpy.uint8).tobytes()
        self.cube()
        for ending in ["stl", "obj", "ply", "off"]:
            path = self.folder / f"noise.{ending}"
            path.write_bytes(noise)
            done = subprocess.run([PROGRAM, "mesh", path, "--unit", "mm", "--resurface", "2"], capture_output=True, timeout=100, check=False)
            self.assertEqual((done.returncode, done.stdout), (2, b""))
            self.assertIn(path.name.encode(), done.stderr)
        # Lines of an OBJ file that are missing at its end are not known to be; then the mesh has holes.
        content = (self.folder / "skin.obj").read_bytes()
        for share in (0.02, 0.3, 0.6, 0.95):
            (self.folder / "short.obj").write_bytes(content[:int(share * len(content))])
            done = self.touchfield("mesh", "short.obj")
            self.assertIn(done.returncode, (0, 2), (share, done.stdout))
            if done.returncode == 0:
                self.assertIn("faults ", done.stdout)

    def test_faces_without_area(self):
        flat = self.obj([[0, 0, 0], [100, 0, 0], [200, 0, 0]], [[0, 1, 2]])
        self.assertIn("no face has an area", self.run_ok("mesh", flat).stdout)
        self.refused(flat, "--unit", "mm", "--resurface", "2", says="no face has an area")
        same = self.cube([[0, 0, 0]] * 4)
        self.refused(same, says=["skin.obj: ", "no size"])
        mixed = self.cube(numpy.concatenate([CUBE, [[2, 2, 2]]]))
        self.assertEqual(self.report(mixed)["collapsed_faces"], 1)
        self.refused(mixed, "-o", "out.ply", says=["1 face has two corners in one point", "--resurface MM"])

    def test_a_scene_takes_faces_without_area(self):
        # A corner on the middle of the diagonal of the side z = 0, and the face that closes the crack there.
        vertices = numpy.vstack([CORNERS, [[50, 50, 0]]]) * 0.2
        cracked = numpy.concatenate([CUBE[1:], [[0, 8, 1], [8, 3, 1], [0, 3, 8]]])
        self.cube(cracked, vertices)
        scene = self.write("scene.yaml", """\
name: flat
array: {grid: {count: [4, 4]}}
body: {mesh: {file: skin.obj, unit: mm}, place: {at_mm: [0, 0, 100]}, edge_mm: 4}
solve: {methods: [{fixed: {phases_rad: 0}}]}
""")
        notes = json.loads(self.run_ok("check", scene, "--json").stdout)["mesh_notes"]
        self.assertEqual(len(notes), 1, notes)
        self.assertIn("skin.obj: removed 1 face with next to no area", notes[0])


class Resurfacing(Mesh):
    """Two balls in each other, one inside out, with a hole."""

    SCENE = """\
name: resurfaced
array: {grid: {count: [8, 8], pitch_mm: 10.16}}
body:
  mesh: {file: balls.stl, unit: mm, resurface_mm: 2, landmarks: {pole: [0, 0, -8], seam: [5, 0, 6.2]}}
  place: {landmark: pole, at_mm: [0, 0, 60]}
target: {box: {at: pole, size_mm: [8, 8, 6]}, pressure_pa: 500}
solve: {methods: [focus], resonance_check: never}
write: [h5]
"""

    def setUp(self):
        super().setUp()
        ball, triangles = icosphere(3, 8.0)
        two = together((ball, triangles[:-20]), (ball + [10, 0, 0], triangles[:, ::-1]))
        write_stl(self.folder / "balls.stl", *two)

    def scene(self, text=SCENE):
        return self.write("scene.yaml", text)

    def test_a_scene_with_it(self):
        notes = json.loads(self.run_ok("check", self.scene(), "--json").stdout)["mesh_notes"]
        self.assertTrue(any("balls.stl: resurfaced with edges of 2 mm" in note for note in notes), notes)
        self.assertTrue(all("balls.stl: " in note for note in notes), notes)
        self.run_ok("run", self.scene(), "-o", "run")
        with h5py.File(self.folder / "run" / "run.h5") as run:
            vertices = run["mesh/vertices"][:]
        self.assertAlmostEqual(vertices[:, 2].min(), 0.060, delta=1e-4)
        self.assertAlmostEqual(numpy.ptp(vertices[:, 0]), 0.026, delta=3e-4)

    def test_one_of_several_bodies(self):
        text = self.SCENE.replace("body:\n  mesh", "bodies:\n- name: bead\n  sphere: {radius_mm: 4}\n  edge_mm: 2\n"
                                  "  place: {at_mm: [-30, 0, 64]}\n- name: balls\n  mesh")
        text = text.replace("at: pole", "at: balls.pole")
        for value, instead, says in [("resurface_mm: 2", "resurface_mm: 0.001", "mesh.resurface_mm = 0.001 mm is too short"),
                                     ("[5, 0, 6.2]", "[2, 0, 0]", "landmark 'seam'")]:
            self.is_refused("check", self.scene(text.replace(value, instead)), says=says)
        notes = json.loads(self.run_ok("check", self.scene(text), "--json").stdout)["mesh_notes"]
        self.assertTrue(any("resurfaced with edges of 2 mm" in note for note in notes), notes)


if __name__ == "__main__":
    unittest.main()
