# SPDX-License-Identifier: Apache-2.0
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from risk_dqn_planner.geometry.contact import ContactMap, Interval, find_contacts
from risk_dqn_planner.geometry.polyline import Polyline

CAR = (4.0, 2.0)
EAST = Polyline.from_points([(-50.0, 0.0), (50.0, 0.0)])


def contacts(other: Polyline, shape: tuple[float, float] = CAR) -> ContactMap:
    return find_contacts(
        EAST, Interval(0.0, 100.0), CAR, other, Interval(0.0, other.length_m), shape
    )


def test_lines_that_stay_apart_have_no_contact() -> None:
    assert contacts(Polyline.from_points([(-50.0, 2.01), (50.0, 2.01)])).count == 0


@pytest.mark.parametrize("shift", [0.0, 0.0123, 0.05, 0.0999])
def test_zone_does_not_depend_on_where_samples_fall(shift: float) -> None:
    north = Polyline.from_points([(shift, -30.0 - 2.0 * shift), (shift, 40.0)])
    found = contacts(north)
    assert found.count == 1
    ego, own = found.zone(1)
    assert (ego.start, ego.end) == pytest.approx((47.0 + shift, 53.0 + shift), abs=1e-6)
    assert (own.start, own.end) == pytest.approx((27.0 + 2.0 * shift, 33.0 + 2.0 * shift), abs=1e-6)


@settings(deadline=None, max_examples=30)
@given(angle=st.floats(0.3, math.pi - 0.3), length=st.floats(2.0, 9.0), width=st.floats(1.0, 2.5))
def test_zone_of_a_straight_crossing_is_that_of_two_strips(
    angle: float, length: float, width: float
) -> None:
    cos, sin = math.cos(angle), math.sin(angle)
    line = Polyline.from_points([(-40.0 * cos, -40.0 * sin), (40.0 * cos, 40.0 * sin)])
    ego, own = contacts(line, (length, width)).zone(1)
    # Half a length, and how far along either line the other's strip reaches within its own.
    ego_half = 2.0 + (0.5 * width + 1.0 * abs(cos)) / sin
    own_half = 0.5 * length + (1.0 + 0.5 * width * abs(cos)) / sin
    # Longer only if a corner of the other car, beyond its strip's edge, touches first.
    assert ego.center == pytest.approx(50.0, abs=1e-4)
    assert own.center == pytest.approx(40.0, abs=1e-4)
    assert 0.5 * ego.length == pytest.approx(ego_half, abs=1e-4)
    assert 0.5 * own.length == pytest.approx(own_half, abs=1e-4)


def test_a_line_that_crosses_twice_has_two_contacts() -> None:
    bracket = Polyline.from_points([(-20.0, -30.0), (-20.0, 30.0), (20.0, 30.0), (20.0, -30.0)])
    found = contacts(bracket)
    assert found.count == 2
    first, second = found.zone(1)[0], found.zone(2)[0]
    assert (first.center, second.center) == pytest.approx((30.0, 70.0), abs=1e-6)
    assert found.at(30.0, 30.0) == 1
    assert found.at(70.0, 130.0) == 2
    assert found.at(50.0, 80.0) == 0
    assert found.within(1, Interval(20.0, 40.0), Interval(0.0, 60.0))
    assert not found.within(1, Interval(60.0, 80.0), Interval(0.0, 60.0))


def test_contacts_that_no_car_fits_between_are_one() -> None:
    # Northwards at x = 0 and again, after a turn outside, at x = 7: 1 m between the zones.
    weave = Polyline.from_points([(0.0, -20.0), (0.0, 20.0), (7.0, 20.0), (7.0, -20.0)])
    found = contacts(weave)
    assert found.count == 2
    # 1 m apart on the ego's line, but 41 m on the other one.
    assert found.merged(4.0, 4.0).count == 2
    together = found.merged(1.3, 41.3)
    assert together.count == 1
    ego, _ = together.zone(1)
    assert (ego.start, ego.end) == pytest.approx((47.0, 60.0), abs=1e-6)


def test_a_contact_that_reaches_the_end_of_the_stretch_ends_there() -> None:
    found = find_contacts(
        EAST, Interval(0.0, 51.0), CAR,
        Polyline.from_points([(0.0, -30.0), (0.0, 30.0)]), Interval(0.0, 60.0), CAR,
    )  # fmt: skip
    assert found.zone(1)[0].end == pytest.approx(51.0, abs=1e-9)


def test_intervals() -> None:
    first, second = Interval(1.0, 3.0), Interval(5.0, 9.0)
    assert (second.length, second.center) == (4.0, 7.0)
    assert first.union(second) == Interval(1.0, 9.0)
    assert first.shifted(2.0) == Interval(3.0, 5.0)
    assert first.gap(second) == second.gap(first) == 2.0
    assert first.gap(Interval(2.5, 9.0)) == -0.5
