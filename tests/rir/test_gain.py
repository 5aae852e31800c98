import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rir import GainPattern, SignalError
from rir.harmonics import evaluate_harmonics, harmonic_count, harmonic_order
from rir.harmonics_kernel import fill_harmonics


def sphere(count: int, seed: int = 0) -> np.ndarray:
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def quadrature(order: int) -> tuple[np.ndarray, np.ndarray]:
    """Return directions and weights that integrate harmonics up to 2 * order."""
    nodes, weights = np.polynomial.legendre.leggauss(order + 1)
    azimuths = np.arange(2 * order + 2) * np.pi / (order + 1)
    z, phi = (grid.ravel() for grid in np.meshgrid(nodes, azimuths, indexing="ij"))
    planar = np.sqrt(1 - z**2)
    directions = np.stack([planar * np.cos(phi), planar * np.sin(phi), z], axis=1)
    return directions, np.repeat(weights, len(azimuths)) * np.pi / (order + 1)


def test_harmonics_are_orthonormal() -> None:
    directions, weights = quadrature(6)
    basis = evaluate_harmonics(directions, 6)
    gram = basis.T @ (weights[:, None] * basis)
    np.testing.assert_allclose(gram, np.eye(49), atol=1e-12)


def test_addition_theorem_holds_up_to_order_20() -> None:
    a, b = sphere(20, 1), sphere(20, 2)
    for degree in (1, 4, 20):
        part = slice(degree**2, (degree + 1) ** 2)
        products = (
            evaluate_harmonics(a, 20)[:, part] * evaluate_harmonics(b, 20)[:, part]
        )
        legendre = np.polynomial.legendre.Legendre.basis(degree)(np.sum(a * b, axis=1))
        np.testing.assert_allclose(
            products.sum(axis=1), (2 * degree + 1) / (4 * np.pi) * legendre, atol=1e-11
        )


def test_compiled_harmonics_are_those_of_scipy() -> None:
    from scipy.special import sph_harm_y

    order, basis = 5, np.empty(36)
    for u in sphere(20):
        fill_harmonics(u[0], u[1], u[2], order, basis)
        theta, phi = np.arccos(u[2]), np.arctan2(u[1], u[0])
        for degree in range(order + 1):
            for m in range(degree + 1):
                # scipy has the Condon-Shortley phase and complex harmonics
                wave = (-1) ** m * sph_harm_y(degree, m, theta, phi)
                wave *= np.sqrt(2) if m else 1
                k = degree * degree + degree
                assert basis[k + m] == pytest.approx(wave.real, abs=1e-13)
                if m:
                    assert basis[k - m] == pytest.approx(wave.imag, abs=1e-13)
        np.testing.assert_allclose(basis, evaluate_harmonics(u, order), atol=1e-13)


def test_first_order_harmonics_are_y_z_x() -> None:
    directions = sphere(10)
    scale = np.sqrt(3 / (4 * np.pi))
    np.testing.assert_allclose(
        evaluate_harmonics(directions, 1)[:, 1:], scale * directions[:, [1, 2, 0]]
    )


def test_counts_and_orders() -> None:
    assert [harmonic_order(harmonic_count(n)) for n in range(6)] == list(range(6))
    with pytest.raises(ValueError, match="10 coefficients do not fill an order"):
        harmonic_order(10)


def test_omni_is_one_everywhere_and_cardioid_follows_its_law() -> None:
    directions = sphere(50)
    np.testing.assert_allclose(GainPattern.omni().gain(directions), 1.0)
    np.testing.assert_allclose(
        GainPattern.cardioid().gain(directions)[:, 0], 0.5 + 0.5 * directions[:, 0]
    )


def test_mean_square_is_the_diffuse_field_gain() -> None:
    # The mean of (1 + cos)^2 / 4 over the sphere is 1/3.
    np.testing.assert_allclose(GainPattern.cardioid().mean_square, [1 / 3])
    np.testing.assert_allclose(GainPattern.omni().mean_square, [1.0])


def test_fit_recovers_a_pattern_of_its_order() -> None:
    rng = np.random.default_rng(3)
    truth = GainPattern(rng.normal(size=(2, 25)), np.array([500.0, 2000.0]))
    directions = sphere(80, 4)
    fitted = GainPattern.fit(
        directions, truth.gain(directions), order=4, bands=truth.bands
    )
    np.testing.assert_allclose(fitted.coefficients, truth.coefficients, atol=1e-10)


def test_fit_with_too_few_directions_says_so() -> None:
    with pytest.raises(SignalError, match="25 coefficients; 9 directions cannot"):
        GainPattern.fit(sphere(9), np.ones(9))


def test_bands_are_interpolated_in_log_frequency() -> None:
    pattern = GainPattern(np.array([[1.0], [3.0]]), np.array([250.0, 1000.0]))
    between = pattern.at_bands([125.0, 500.0, 4000.0]).coefficients[:, 0]
    np.testing.assert_allclose(between, [1.0, 2.0, 3.0])


def test_turning_the_device_turns_the_gain() -> None:
    from rir import Pose

    turn = Rotation.random(rng=np.random.default_rng(5))
    pose = Pose(np.zeros(3), turn.as_quat())
    local = sphere(20, 6)
    np.testing.assert_allclose(pose.to_local(turn.apply(local)), local, atol=1e-12)
