import csv
import json
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import touchfield as tf


@pytest.fixture
def plan(tmp_path, finger):
    path = tmp_path / "plan.yaml"
    path.write_text(f"base: {finger}\n"
                    "set: {solve.methods: [focus, paper], solve.optimality_bound: false, evaluation: same, write: [h5], field: []}\n"
                    "grid: {target.pressure_pa: [400, 500], array.grid.count: [[4, 4], [8, 8]]}\n")
    return path


def test_columns_are_those_of_the_program(touchfield, plan, tmp_path):
    columns = tf.sweep(plan, tmp_path / "mine", threads=2, jobs=1)
    touchfield("sweep", plan, "-o", tmp_path / "program", "--threads", "2", "--jobs", "1", "--quiet")
    with open(tmp_path / "program/sweep.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(columns) == list(rows[0])
    for name in ("relative_error", "leakage", "peak_pa", "case", "target.pressure_pa", "channels"):
        assert np.array_equal(columns[name], [float(row[name]) for row in rows]), name
    assert [row["name"] for row in rows] == columns["name"].tolist() == ["focus", "paper"] * 4
    assert columns["array.grid.count"].dtype.kind == "U" and columns["status"].tolist() == ["ok"] * 8
    again = tf.read_sweep(tmp_path / "mine")
    assert list(again) == list(columns) and np.array_equal(again["relative_error"], columns["relative_error"])
    assert np.array_equal(tf.sweep(plan, tmp_path / "mine")["seconds"], columns["seconds"])  # nothing is computed again


def test_the_list_is_that_of_the_program(touchfield, plan):
    cases = tf.list_sweep(plan)
    said = touchfield("sweep", plan, "--list", "--json").stdout.splitlines()
    steady = ("case", "name", "inputs", "faces", "channels", "reason")  # speeds are measured each time
    assert [{key: case[key] for key in steady} for case in cases] == [{key: json.loads(line)[key] for key in steady} for line in said]
    assert len(cases) == 4 and all(case["seconds"] > 0 and case["memory_mib"] > 0 for case in cases)


def test_a_case_that_fails_is_a_row(plan, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("mmap.py", "numpy.py"):  # which workers must not import
        (tmp_path / name).write_text("raise SystemExit(9)")
    plan.write_text(plan.read_text().replace("[400, 500]", "[400]").replace("[[4, 4], [8, 8]]", "[[4, 4]]").replace(
        "field: []", "body.place.at_mm: [0, 0, -5]"))
    columns = tf.sweep(plan, tmp_path / "out")
    assert columns["status"].tolist() == ["failed"]
    assert "transducer" in columns["reason"][0] and np.isnan(columns["relative_error"][0])


def test_interrupt_ends_the_workers_and_keeps_what_is_done(plan, tmp_path):
    plan.write_text(plan.read_text().replace("evaluation: same", "evaluation: same, body.edge_mm: 0.8, solve.precision: double"))
    code = """if True:
        import sys, time
        import touchfield as tf
        try:
            tf.sweep(sys.argv[1], sys.argv[2])
        except KeyboardInterrupt:
            print(time.monotonic(), flush=True)
            time.sleep(2)
        """
    process = subprocess.Popen([sys.executable, "-c", code, str(plan), str(tmp_path / "out")], stdout=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 200
    while not list((tmp_path / "out/cases").glob("0*")):  # the first case is done, the next one under way
        assert time.monotonic() < deadline
        time.sleep(0.1)
    sent = time.monotonic()
    process.send_signal(signal.SIGINT)
    assert float(process.stdout.readline()) - sent < 1
    assert process.wait(timeout=30) == 0
    assert {path.suffix for path in (tmp_path / "out/cases").glob(".0*")} <= {".lock"} and (tmp_path / "out/sweep.csv").exists()
