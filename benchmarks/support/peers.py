"""Other libraries' filters with Steerway's motion model, each with a method `stream(positions)`."""

from datetime import datetime, timedelta

import numpy as np
from tests.five_state_by_matrices import MEASURED, ExactTurn

from benchmarks.support.record import PROFILE, STEP

MODEL = ExactTurn(STEP, PROFILE.speed_noise, PROFILE.course_rate_noise, PROFILE.speed_decay, PROFILE.course_rate_decay)
R = PROFILE.position_std**2 * np.eye(2)


class FilterPy:
    """filterpy.kalman.ExtendedKalmanFilter."""

    def __init__(self, x, p):
        from filterpy.kalman import ExtendedKalmanFilter

        class Filter(ExtendedKalmanFilter):
            def predict_x(self, u=0):
                self.x, self.F, self.Q = MODEL.step(self.x)

        self._filter = Filter(dim_x=5, dim_z=2)
        self._filter.x, self._filter.P, self._filter.R = x, p, R

    def stream(self, positions):
        ekf = self._filter

        def measured(x):
            return x[:2]

        def slope(_):
            return MEASURED

        for north, east in positions:
            ekf.predict()
            if north == north:
                ekf.update(np.array([north, east]), slope, measured)

    @property
    def x(self):
        return self._filter.x

    @property
    def p(self):
        return self._filter.P


class StoneSoup:
    """Stone Soup's extended Kalman predictor and updater."""

    def __init__(self, x, p):
        from stonesoup.models.measurement.linear import LinearGaussian
        from stonesoup.predictor.kalman import ExtendedKalmanPredictor
        from stonesoup.types.state import GaussianState
        from stonesoup.updater.kalman import ExtendedKalmanUpdater

        self._measurement = LinearGaussian(ndim_state=5, mapping=(0, 1), noise_covar=R)
        self._predictor = ExtendedKalmanPredictor(_stone_soup_model())
        self._updater = ExtendedKalmanUpdater(self._measurement, use_joseph_cov=True)
        self._time = datetime(2024, 1, 1)
        self._state = GaussianState(x.reshape(-1, 1), p, timestamp=self._time)

    def stream(self, positions):
        from stonesoup.types.detection import Detection
        from stonesoup.types.hypothesis import SingleHypothesis

        step, state = timedelta(seconds=STEP), self._state
        for north, east in positions:
            self._time += step
            state = self._predictor.predict(state, timestamp=self._time)
            if north == north:
                fix = Detection([[north], [east]], timestamp=self._time, measurement_model=self._measurement)
                state = self._updater.update(SingleHypothesis(state, fix))
        self._state = state

    @property
    def x(self):
        return np.array(self._state.state_vector, float).ravel()

    @property
    def p(self):
        return np.array(self._state.covar, float)


def _stone_soup_model():
    """Stone Soup calls f, F and Q separately, Q without the state; so one step computes and stores all three."""
    from stonesoup.models.base import TimeVariantModel
    from stonesoup.models.transition.base import TransitionModel
    from stonesoup.types.array import StateVector

    class Motion(TransitionModel, TimeVariantModel):
        ndim_state = 5
        _of, _taken = None, None

        def _step(self, state):
            if state is not self._of:
                self._of, self._taken = state, MODEL.step(np.asarray(state.state_vector).ravel())
            return self._taken

        def function(self, state, noise=False, **_):
            return StateVector(self._step(state)[0])

        def jacobian(self, state, **_):
            return self._step(state)[1]

        def covar(self, **_):
            return self._taken[2]

        def pdf(self, state1, state2, **_):
            raise NotImplementedError

        def rvs(self, num_samples=1, **_):
            raise NotImplementedError

    return Motion()
