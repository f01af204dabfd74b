"""The package within a process: other threads, interrupts, memory, forks, what else is imported."""

import itertools
import os
import signal
import subprocess
import sys
import threading
import time

import pytest

import touchfield as tf

# Minutes of work in small steps, and one that is a single long factorisation.
LONG = {"body.edge_mm": 0.5, "solve.iterations": 100000, "solve.precision": "double", "solve.solver": "gmres", "solve.tolerance": 1e-13}
FACTORISED = {"body.edge_mm": 0.75, "solve.solver": "lu", "solve.precision": "double"}


@pytest.mark.parametrize("changes", [LONG, FACTORISED])
def test_interrupt_within_a_second(finger, changes):
    code = """if True:
        import sys, time
        import touchfield as tf
        print("ready", flush=True)
        try:
            tf.run(sys.argv[1], set=eval(sys.argv[2]))
        except KeyboardInterrupt:
            print(time.monotonic(), flush=True)
            print(len(tf.sphere(0.01, 0.005)))
        """
    process = subprocess.Popen([sys.executable, "-c", code, str(finger), repr(changes)], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "ready\n"
    time.sleep(4)
    assert process.poll() is None, "the scene is too small for this test"
    sent = time.monotonic()
    process.send_signal(signal.SIGINT)
    heard = float(process.stdout.readline())
    assert heard - sent < 1
    assert int(process.stdout.readline()) > 0
    assert process.wait(timeout=30) == 0  # whether or not something still computes


def test_other_threads_go_on(finger):
    counted, stop = [0], threading.Event()

    def count():
        while not stop.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    start = time.monotonic()
    tf.run(finger)
    passed, steps = time.monotonic() - start, counted[0]
    stop.set()
    thread.join()
    assert steps > 50 * passed


def test_computations_of_several_threads_take_turns(finger, run):
    found = []
    threads = [threading.Thread(target=lambda: found.append(tf.run(finger, threads=2))) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 3 and all((each.pressures["surface"] == run.pressures["surface"]).all() for each in found)


def test_in_a_forked_process(finger):
    tf.sphere(0.01, 0.005)
    tf.check(finger)
    child = os.fork()
    if child == 0:
        os._exit(0 if len(tf.run(finger).methods) == 3 else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


@pytest.mark.parametrize("limit", ["-v 200000", "-v 400000", "-d 200000"])
def test_limits_that_leave_no_room_are_named(limit):
    done = subprocess.run(["bash", "-c", f"ulimit {limit}; exec {sys.executable} -c 'import touchfield'"], capture_output=True,
                          text=True, timeout=10, env=os.environ | {"OMP_NUM_THREADS": "4"})
    assert done.returncode == 1 and f"ImportError: touchfield: `ulimit {limit}` leaves OpenBLAS no room" in done.stderr


def test_variables_that_libraries_crash_by(finger):
    name, value = "OMP_NUM_THREADS", "100000"
    done = subprocess.run([sys.executable, "-c", f"import touchfield; touchfield.run({str(finger)!r})"], capture_output=True,
                          text=True, timeout=100, env=os.environ | {name: value})
    assert done.returncode == 1 and f"InputError: {name} = '{value}'" in done.stderr


def test_a_thousand_calls_leak_nothing(python, finger):
    said = python("""
        import gc, pickle, resource, sys
        import numpy as np
        import touchfield as tf

        def resident():
            gc.collect()
            with open("/proc/self/statm") as file:
                return int(file.read().split()[1]) * resource.getpagesize() / 2**20

        array = tf.Array.of_scene(sys.argv[1])
        ball = tf.sphere(5e-3, 2.5e-3)
        model = tf.Model(sys.argv[1])
        kept = tf.run(model)

        def use():
            mesh = tf.Mesh(ball.vertices, ball.triangles)
            h = tf.transfer(mesh, array, faces=[0, 1, 2])
            problem = tf.Problem(h, [1, 1, 1], mesh.areas[:3])
            solution = tf.surface(problem, iterations=2, progress=lambda stage, fraction: None)
            target = tf.Target(mesh.translate([0, 0, 1e-3]), [0, 1, 2], 1)
            pickle.loads(pickle.dumps((mesh, array, problem, solution, target)))
            array.field([[0, 0, 0.1]], tf.gs(h, target, iterations=1))
            tf.send(array, solution)
            try:
                tf.Mesh(ball.vertices[:3], ball.triangles)
            except tf.InputError:
                pass
            return kept.pressures, kept.metrics, kept.fields, kept.mesh.areas, kept.target.faces, model.mesh.landmarks, solution.phases

        tf.optimality_bound(tf.Problem(tf.transfer(ball, array), np.ones(len(ball)), ball.areas))
        for _ in range(100):
            use()
        before = resident()
        for _ in range(1000):
            use()
        print(resident() - before)
        """, finger, timeout=300)
    assert float(said) < 4  # MiB, of a thousand meshes of 20 kB each


def test_beside_the_wheels_of_others_in_any_order(python, tmp_path, finger):
    """Each with its own HDF5, BLAS and OpenMP: all compute, and both write and read HDF5."""
    scene = tmp_path / "plain.yaml"
    scene.write_text(finger.read_text().replace("optimality_bound: true", "optimality_bound: false").replace("evaluation: {split: 1}", "evaluation: none"))
    tf.run(scene, threads=2).save(tmp_path / "run.h5")
    code = """
        import sys
        for name in sys.argv[3:]:
            __import__(name)
        import h5py, numpy, scipy.linalg, touchfield
        a = numpy.random.default_rng(1).normal(size=(300, 300))
        assert numpy.allclose(scipy.linalg.solve(a, a @ a), a) and numpy.allclose(numpy.linalg.solve(a, a @ a), a)
        mine = touchfield.read_run(sys.argv[1])
        with h5py.File(sys.argv[1]) as file:
            assert (file["methods/surface/pressure"][:] == mine.pressures["surface"]).all()
        with h5py.File("other.h5", "w") as file:
            file["a"] = a
            touchfield.run(sys.argv[2], threads=2).save("again.h5")
            assert (file["a"][:] == a).all()
        assert (touchfield.read_run("again.h5").pressures["surface"] == mine.pressures["surface"]).all()
        assert numpy.allclose(numpy.linalg.solve(a, a @ a), a)
        """
    orders = list(itertools.permutations(("touchfield", "h5py", "scipy.linalg")))  # whose latter two import numpy
    orders += [("numpy", "touchfield", "h5py"), ("numpy", "touchfield", "scipy.linalg")]
    for number, order in enumerate(orders):
        folder = tmp_path / str(number)
        folder.mkdir()
        python(code, tmp_path / "run.h5", scene, *order, cwd=folder)


@pytest.mark.skipif(" avx2 " not in open("/proc/cpuinfo").read(), reason="the processor has no better kernels")
def test_kernels_that_fit_the_processor(python, finger, run):
    """OpenBLAS takes a processor that it does not know for an old one: its kernels are chosen anew when the package is loaded."""
    core, same = python("""
        import ctypes, importlib.util, os, pathlib, sys
        os.environ["OPENBLAS_CORETYPE"] = "Prescott"
        folder = pathlib.Path(importlib.util.find_spec("touchfield").submodule_search_locations[0])
        ctypes.CDLL(next(folder.glob("libtouchfield.so*")))  # which loads OpenBLAS
        del os.environ["OPENBLAS_CORETYPE"]
        import touchfield as tf
        run = tf.run(sys.argv[1], threads=2)
        print(run.provenance["blas_core"], run.metrics["surface"]["cost"])
        """, finger).split()
    assert core != "Prescott"
    assert float(same) == pytest.approx(run.metrics["surface"]["cost"], rel=1e-4)  # 3e-6 among four cores, by 8 steps' rounding
    chosen = python("""
        import os, sys
        os.environ["OPENBLAS_CORETYPE"] = "Prescott"
        import touchfield as tf
        print(tf.run(sys.argv[1]).provenance["blas_core"], os.environ["OPENBLAS_CORETYPE"])
        """, finger)
    assert chosen.split() == ["Prescott", "Prescott"]  # a user's choice stays
