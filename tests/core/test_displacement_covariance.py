import numpy as np
from hypothesis import given

from mskgrasp.core.displacement_covariance import object_displacement_covariance
from mskgrasp.core.geometry import wrap_angle
from mskgrasp.core.grasp import to_object_displacement
from tests.core.test_grasp import centres, shifts


@given(shifts, centres)
def test_the_covariance_is_that_of_the_derivative(displacement, centre):
    variance = np.array([1e-6, 4e-6, 9e-6, 1e-4])
    covariance = object_displacement_covariance(displacement, variance, centre)
    jacobian = np.zeros((4, 4))
    for k in range(4):
        step = np.zeros(4)
        step[k] = 1e-6
        ahead, behind = (to_object_displacement(displacement + s * step, centre) for s in (1, -1))
        change = ahead - behind
        change[3] = wrap_angle(change[3])
        jacobian[:, k] = change / 2e-6
    assert np.allclose(covariance, jacobian @ np.diag(variance) @ jacobian.T, atol=1e-10)
