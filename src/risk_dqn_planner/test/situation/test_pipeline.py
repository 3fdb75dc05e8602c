# SPDX-License-Identifier: Apache-2.0
"""Every fault of the input becomes a status with a sentence; nothing is raised."""

import pytest

from risk_dqn_planner.errors import (
    DisconnectedRouteError,
    EgoPoseError,
    InputError,
    MapError,
    NoConflictError,
    PlannerError,
    WrongWayError,
)
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.situation.config import SituationConfig
from risk_dqn_planner.situation.inputs import EgoPose, Perception, object_arrays
from risk_dqn_planner.situation.pipeline import SituationPipeline
from risk_dqn_planner.situation.report import Fault, FaultyInput, Status, fault_of
from risk_dqn_planner.situation.warm_up import crossing_model, square

ON_ROUTE = EgoPose(-20.0, 0.0, 0.0, 4.0)


def perception(ego: EgoPose = ON_ROUTE, rows: tuple[tuple[float, ...], ...] = ()) -> Perception:
    return Perception(ego, object_arrays(rows), square(50.0))


class Maker:
    """Builds the crossing for route (10,) and counts; refuses all others."""

    def __init__(self) -> None:
        self.built = 0

    def __call__(self, route: tuple[int, ...]) -> IntersectionModel:
        if route != (10,):
            raise DisconnectedRouteError("lanelet 3 does not follow lanelet 2")
        self.built += 1
        return crossing_model()


def test_without_a_route_one_is_missing() -> None:
    report = SituationPipeline(Maker()).report(5, perception())
    assert (report.stamp_ns, report.status) == (5, Status.MISSING_INPUT)
    assert report.source is FaultyInput.ROUTE
    assert report.text == "no route received yet"
    assert report.situations is None


def test_a_route_that_does_not_fit_is_reported_until_a_good_one_comes() -> None:
    pipeline = SituationPipeline(Maker())
    pipeline.select((2, 3))
    bad = pipeline.report(0, perception())
    pipeline.select((10,))
    good = pipeline.report(0, perception())
    assert (bad.status, bad.route) == (Status.BAD_ROUTE, (2, 3))
    assert bad.text == "lanelet 3 does not follow lanelet 2"
    assert (good.status, good.text, good.route) == (Status.OK, "", (10,))
    assert good.stop_line_derived
    assert good.situations is not None


def test_a_route_that_comes_back_is_not_built_again() -> None:
    maker = Maker()
    pipeline = SituationPipeline(maker)
    for route in ((10,), (2, 3), (10,)):
        pipeline.select(route)
    assert maker.built == 1
    assert pipeline.model is not None


@pytest.mark.parametrize(
    ("seen", "status", "words"),
    [
        (perception(EgoPose(-20.0, 9.0, 0.0, 4.0)), Status.OFF_ROUTE, "9.0 m beside"),
        (perception(EgoPose(-20.0, 0.0, 3.0, 4.0)), Status.WRONG_WAY, "turned 172 degrees"),
        (perception(EgoPose(float("nan"), 0.0, 0.0, 4.0)), Status.NOT_FINITE, "x_m is nan"),
        (perception(rows=((0.0, 0.0, 0.0, float("inf")),)), Status.NOT_FINITE, "object 1"),
        (perception(rows=((0.0, 0.0, 0.0, 150.0),)), Status.IMPLAUSIBLE_SPEED, "object 1"),
    ],
)
def test_a_fault_of_the_input_becomes_its_status(
    seen: Perception, status: Status, words: str
) -> None:
    pipeline = SituationPipeline(Maker())
    pipeline.select((10,))
    report = pipeline.report(7, seen)
    assert (report.stamp_ns, report.status, report.route) == (7, status, (10,))
    assert words in report.text
    assert report.situations is None


@pytest.mark.parametrize(
    ("error", "status", "source"),
    [
        (EgoPoseError("x"), Status.OFF_ROUTE, FaultyInput.ODOMETRY),
        (WrongWayError("x"), Status.WRONG_WAY, FaultyInput.ODOMETRY),
        (NoConflictError("x"), Status.BAD_ROUTE, FaultyInput.ROUTE),
        (MapError("x"), Status.NOT_CONFIGURED, FaultyInput.MAP),
        (InputError("x", source=FaultyInput.OBJECTS), Status.MALFORMED_INPUT, FaultyInput.OBJECTS),
        (
            InputError("x", Status.WRONG_FRAME, FaultyInput.ODOMETRY),
            Status.WRONG_FRAME,
            FaultyInput.ODOMETRY,
        ),
    ],
    ids=lambda value: getattr(value, "name", type(value).__name__),
)
def test_every_error_names_its_fault(
    error: PlannerError, status: Status, source: FaultyInput
) -> None:
    assert fault_of(7, error) == Fault(7, status, source, "x")


SECOND_NS = 1_000_000_000
HIDDEN_FROM_20_M = Perception(ON_ROUTE, object_arrays(), square(20.0))
ALL_SEEN = Perception(ON_ROUTE, object_arrays(), square(80.0))


def remembering() -> SituationPipeline:
    pipeline = SituationPipeline(Maker(), SituationConfig(memory="tracked"))
    pipeline.select((10,))
    return pipeline


def hidden_m(pipeline: SituationPipeline, time_s: float, seen: Perception) -> float:
    # Stamps are of the epoch: the memory must not lose them to rounding.
    report = pipeline.report(int((1.7e9 + time_s) * SECOND_NS), seen)
    assert report.situations is not None
    return float(report.situations.lane_hidden_distance_m[0, 0])


def test_memory_knows_the_time_by_the_stamps() -> None:
    pipeline = remembering()
    assert hidden_m(pipeline, 0.0, ALL_SEEN) == pytest.approx(70.0)
    # From beyond the end at 70 m with 7 m/s.
    assert hidden_m(pipeline, 1.0, HIDDEN_FROM_20_M) == pytest.approx(63.0, abs=1e-4)
    # A second in which the ego is off its route is a gap: vehicles drive on.
    assert pipeline.report(0, perception(EgoPose(0.0, 30.0, 0.0, 4.0))).situations is None
    assert hidden_m(pipeline, 3.0, HIDDEN_FROM_20_M) == pytest.approx(49.0, abs=1e-4)


def test_memory_ends_with_the_route() -> None:
    pipeline = remembering()
    hidden_m(pipeline, 0.0, ALL_SEEN)
    pipeline.select((2, 3))
    pipeline.select((10,))
    assert hidden_m(pipeline, 0.5, HIDDEN_FROM_20_M) == pytest.approx(20.0)


def test_an_old_visible_area_tells_less() -> None:
    pipeline = remembering()
    old = HIDDEN_FROM_20_M._replace(visible_area_age_s=0.3)
    assert hidden_m(pipeline, 0.0, old) == pytest.approx(17.9)


def test_without_a_memory_as_well() -> None:
    pipeline = SituationPipeline(lambda _: crossing_model())
    pipeline.select((10,))
    old = HIDDEN_FROM_20_M._replace(visible_area_age_s=0.3)
    assert hidden_m(pipeline, 0.0, old) == pytest.approx(17.9)
    # Whoever was hidden just before the zone may have come into it, and not further than its exit.
    unseen = HIDDEN_FROM_20_M._replace(visible_area=square(4.0), visible_area_age_s=5.0)
    assert hidden_m(pipeline, 0.0, unseen) == pytest.approx(-3.0)
