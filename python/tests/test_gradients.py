"""Gradients against central differences: of problems, through scattering, and by PyTorch and JAX where they are installed."""

import pickle
import re
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse.linalg

import touchfield as tf
from conftest import SOURCE

RANDOM = np.random.default_rng(1)


def blocks():
    """The code of docs/python.md."""
    section = (SOURCE / "docs/python.md").read_text().partition("## Gradients\n")[2].partition("\n## ")[0]
    return re.findall(r"```python\n(.*?)```", section, re.DOTALL)


def numbers(*shape):
    return RANDOM.normal(size=shape) + 1j * RANDOM.normal(size=shape)


@pytest.fixture(scope="module")
def ball():
    return tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])


@pytest.fixture(scope="module")
def scattering(ball):
    return tf.Scattering(*ball, threads=2)


@pytest.fixture(scope="module")
def problems(ball):
    skin, array = ball
    h = tf.transfer(skin, array)
    target = tf.Target.box(skin, [0, 0, -8e-3], [8e-3, 8e-3, 6e-3], 300)
    return tf.Problem.of(h, target), tf.RadiationProblem.of(h, target)


def differences(cost, drives, step=1e-5):
    """dC/d Re q + i dC/d Im q."""
    slopes = [[(cost(drives + step * part * unit) - cost(drives - step * part * unit)) / (2 * step) for part in (1, 1j)]
              for unit in np.eye(len(drives))]
    return np.array(slopes) @ [1, 1j]


def near(found, expected, share=1e-5):
    return np.linalg.norm(found - expected) < share * np.linalg.norm(expected)


@pytest.mark.parametrize("which", [0, 1], ids=["Problem", "RadiationProblem"])
def test_gradient_is_that_of_differences(problems, which):
    problem, drives = problems[which], 0.5 * numbers(16)
    gradient = problem.gradient(drives)
    assert near(gradient, differences(problem.cost, drives))
    phases = np.angle(drives)
    by_phases = differences(lambda phi: problem.cost(abs(drives) * np.exp(1j * phi.real)), phases.astype(complex)).real
    assert near(np.imag(drives.conj() * gradient), by_phases)
    by_amplitudes = differences(lambda a: problem.cost(a.real * np.exp(1j * phases)), abs(drives).astype(complex)).real
    assert near(np.real(np.exp(-1j * phases) * gradient), by_amplitudes)
    assert near(problem.gradient(np.ones(16)), differences(problem.cost, np.ones(16, complex)))
    assert np.array_equal(problem.gradient(drives, threads=1), problem.gradient(drives, threads=1))
    with pytest.raises(tf.InputError, match="gradient: drives"):
        problem.gradient(drives[1:])


def test_gradient_in_silence_is_a_subgradient(problems):
    gradient = problems[0].gradient(np.zeros(16))
    way = -1e-6 * gradient / np.linalg.norm(gradient)
    assert np.isfinite(gradient).all() and problems[0].cost(way) < problems[0].cost(np.zeros(16))
    assert not problems[1].gradient(np.zeros(16)).any()  # a cost without a kink there


@pytest.mark.parametrize("scheme", ["paper", "chief", "burton_miller", "burton_miller_polished"])
def test_scattering_is_h_and_its_adjoint(ball, scheme):
    scattering, h = tf.Scattering(*ball, scheme=scheme), tf.transfer(*ball, scheme=scheme)
    assert scattering.shape == h.shape
    drives, back = numbers(16, 2), numbers(len(ball[0]), 2)
    assert near(scattering @ drives, tf.scatter(*ball, drives, scheme=scheme), 1e-4)
    assert near(scattering.rmatvec(back), h.conj().T @ back, 1e-3)
    assert np.vdot(back[:, 0], scattering @ drives[:, 0]) == pytest.approx(np.vdot(scattering.rmatvec(back[:, 0]), drives[:, 0]), rel=1e-5)


def test_scattering_for_scipy_and_pickle(ball, scattering):
    operator, drives = scipy.sparse.linalg.aslinearoperator(scattering), numbers(16)
    pressure = scattering @ drives
    assert np.array_equal(operator @ drives, pressure) and np.array_equal(pickle.loads(pickle.dumps(scattering)) @ drives, pressure)
    assert np.array_equal(operator.H @ pressure, scattering.rmatvec(pressure))
    assert near(scattering @ scipy.sparse.linalg.lsmr(operator, pressure)[0], pressure, 1e-3)
    for wrong in (drives[1:], pressure):
        with pytest.raises(tf.InputError, match="per channel"):
            scattering @ wrong


def test_gradient_by_places_of_transducers(ball, scattering):
    skin, array = ball
    drives, weights = numbers(16), skin.areas
    _, code = blocks()
    names = {"np": np, "tf": tf, "array": array, "finger": skin, "solution": SimpleNamespace(drives=drives)}
    exec(code, names)
    assert near(names["back"], differences(lambda q: weights @ abs(scattering @ q) ** 2, drives, 0.1))

    def cost(move):
        moved = np.array(array.positions)
        moved[5] += move.real
        return weights @ abs(scattering.with_array(tf.Array(moved)) @ drives) ** 2

    assert near(names["by_places"][5], differences(cost, np.zeros(3, complex)).real)


def test_torch(ball, scattering, problems, tmp_path, monkeypatch, capsys):
    torch = pytest.importorskip("torch")
    import touchfield.torch as wrapped

    drives = torch.from_numpy(0.5 * numbers(16)).requires_grad_()
    for problem in problems:
        assert torch.autograd.gradcheck(lambda q: wrapped.cost(problem, q) / problem.cost(np.zeros(16)), drives)
        value = 3 * wrapped.cost(problem, drives)
        gradient, = torch.autograd.grad(value, drives)
        assert value.item() == 3 * problem.cost(drives.detach().numpy()) and near(gradient.numpy(), 3 * problem.gradient(drives.detach().numpy()))
    weights = torch.linspace(0, 1, len(ball[0]), dtype=torch.float64)
    both = torch.stack([drives, 2 * drives.conj()], dim=1)
    loss = lambda q: (weights[:, None] * wrapped.pressure(scattering, q).abs() ** 2).sum()
    gradient, = torch.autograd.grad(loss(both), drives)
    of_numbers = lambda q: (weights.numpy()[:, None] * abs(scattering @ np.stack([q, 2 * q.conj()], 1)) ** 2).sum()
    assert near(gradient.numpy(), differences(of_numbers, drives.detach().numpy(), 0.1))
    for wrong in (drives.to(torch.complex64), drives.abs()):
        with pytest.raises(TypeError, match="complex128"):
            wrapped.pressure(scattering, wrong)
    (tmp_path / "scenes").symlink_to(SOURCE / "scenes")
    monkeypatch.chdir(tmp_path)
    code, _ = blocks()
    names = {"np": np, "tf": tf}
    exec(code.replace("width_8mm", "capsule").replace("range(30)", "range(10)"), names)
    surface = tf.evaluate(names["model"], tf.surface(tf.Problem.of_model(names["model"]), iterations=30))
    assert tf.evaluate(names["model"], names["phases"].detach().numpy())["relative_error"] < surface["relative_error"] + 0.03


def test_jax(ball, scattering, problems):
    jax = pytest.importorskip("jax")
    import touchfield.jax as wrapped

    with pytest.raises(TypeError, match="jax_enable_x64"):
        wrapped.cost(problems[0], jax.numpy.ones(16))
    jax.config.update("jax_enable_x64", True)
    drives = 0.5 * numbers(16)
    for problem in problems:
        value, gradient = jax.jit(jax.value_and_grad(lambda q: 3 * wrapped.cost(problem, q)))(drives)
        assert value == 3 * problem.cost(drives) and near(gradient, 3 * problem.gradient(drives).conj())
        many = jax.vmap(jax.grad(lambda q: wrapped.cost(problem, q)))(np.stack([drives, 1j * drives]))
        assert near(many, np.stack([gradient / 3, -1j * gradient / 3]))
    weights = np.linspace(0, 1, len(ball[0]))
    loss = lambda q: (weights * abs(wrapped.pressure(scattering, q)) ** 2).sum()
    gradient = jax.jit(jax.grad(loss))(drives)
    assert near(np.conj(gradient), differences(lambda q: weights @ abs(scattering @ q) ** 2, drives, 0.1))
    assert near(jax.vmap(lambda q: wrapped.pressure(scattering, q))(np.stack([drives, 2 * drives]))[1], 2 * (scattering @ drives))
