"""touchfield mesh: any file gives a report, a closed skin, or a clear error."""

import json
import unittest

import h5py
import numpy

from meshes import icosphere, together, write_stl
from support import CommandTest

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
        self.refused(self.cube(vertices=CORNERS * 0.1), "--remesh", "2", "-o", "out.stl", says=["--unit", "173 mm if in cm"])


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

    def test_a_faulty_mesh_is_written_only_as_a_new_skin(self):
        path = self.cube(CUBE[:, ::-1])
        self.refused(path, "-o", "out.ply", says=["inside out", "--resurface MM"])
        report = self.report(path, "--unit", "mm", "--resurface", "4", "-o", "out.ply")
        self.assertEqual(report["steps"][0], "turned 1 patch outwards")
        self.assertAlmostEqual(self.volume(self.folder / "out.ply"), 1000, delta=5)

    def test_a_width_scene_on_a_foreign_hand(self):
        """Coarse and uneven, as others make them."""
        said = json.loads(self.run_ok("hand", "--pose", "index_up", "--edge-mm", "4", "-o", "fine.obj", "--json").stdout)
        vertices, triangles = thinned(*read_obj(self.folder / "fine.obj"))
        pad = numpy.array(said["landmarks"]["index_pad"])
        path = self.obj(vertices * 1e-3, triangles, "foreign.obj")
        report = self.report(path, "--remesh", "3", "-o", "remeshed.ply")
        self.assertEqual((report["unit"], report["unit_guess"]["certainty"], report["result"]["faults"]), ("m", "sure", []))
        self.assertAlmostEqual(report["result"]["mean_edge_mm"], 3, delta=0.1)
        self.assertAlmostEqual(report["result"]["volume_cm3"] / report["surface"]["volume_cm3"], 1, delta=0.015)
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
        self.is_refused("run", scene, "-o", "out", says=["foreign.obj: the unit is missing", "looks like m ", ". Set body.mesh.unit"])
        self.assertFalse((self.folder / "out").exists())
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
        near = numpy.linalg.norm(points[corners].mean(axis=1) - [0, 0, 0.2], axis=1) < 0.012  # of the place of the pad
        lengths = edge_lengths(points * 1e3, corners[near])
        self.assertLess(abs(lengths.mean() / 2 - 1), 0.1)
        self.assertLess(error["surface"], error["paper"] + 1e-3)
        self.assertLess(error["paper"], error["unscattered"])
        self.assertLess(error["unscattered"], error["focus"])


def thinned(vertices, triangles):
    """Every third face in three about a point near one of its corners."""
    cut = numpy.arange(0, len(triangles), 3)
    middle = len(vertices) + numpy.arange(len(cut))
    a, b, c = triangles[cut].T
    points = 0.7 * vertices[a] + 0.15 * vertices[b] + 0.15 * vertices[c]
    children = [numpy.stack(child, axis=1) for child in ([a, b, middle], [b, c, middle], [c, a, middle])]
    return numpy.concatenate([vertices, points]), numpy.concatenate([numpy.delete(triangles, cut, axis=0), *children])


class Broken(Mesh):
    """Files as they are found: exit code 2 and a clear error, or a report; never a crash."""

    def test_a_file_cut_short(self):
        self.cube()
        # Lines of an OBJ file that are missing at its end are not known to be; then the mesh has holes.
        content = (self.folder / "skin.obj").read_bytes()
        (self.folder / "short.obj").write_bytes(content[:content.rindex(b"f ")])
        self.assertIn("faults ", self.run_ok("mesh", "short.obj").stdout)

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

    def test_slips(self):
        for value, instead, says in [("resurface_mm: 2", "resurface_mm: 0.001", "mesh.resurface_mm = 0.001 mm is too short"),
                                     ("[5, 0, 6.2]", "[2, 0, 0]", "landmark 'seam'")]:
            self.is_refused("check", self.scene(self.SCENE.replace(value, instead)), says=says)


if __name__ == "__main__":
    unittest.main()
