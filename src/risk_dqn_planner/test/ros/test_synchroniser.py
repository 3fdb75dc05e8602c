# SPDX-License-Identifier: Apache-2.0
"""Which messages make a frame, and when. Times in milliseconds; messages are their own names."""

from hypothesis import given
from hypothesis import strategies as st

from risk_dqn_planner.ros.backlog import Backlog
from risk_dqn_planner.ros.streams import AgeLimits, Stamped
from risk_dqn_planner.ros.synchroniser import INPUTS, Frame, Synchroniser, SynchroniserConfig
from risk_dqn_planner.situation.report import Fault, FaultyInput, Status

MS = 1_000_000
ODOMETRY, AREA, OBJECTS = INPUTS
# Far behind all stamps, where no input is ahead of it: the clock of most tests.
ANY_LEAD = AgeLimits(max_input_age_s=0.5, max_input_ahead_s=10.0)


def synchroniser() -> Synchroniser:
    return Synchroniser(SynchroniserConfig(sync_timeout_s=0.05), ANY_LEAD)


def give(
    sync: Synchroniser, source: FaultyInput, stamp_ms: int, steady_ms: int = 0, now_ms: int = 0
) -> None:
    sync.receive(source, stamp_ms * MS, f"{source} {stamp_ms}", now_ms * MS, steady_ms * MS)


def take(sync: Synchroniser, steady_ms: int = 0, now_ms: int = 0) -> Frame | Fault | None:
    return sync.take(now_ms * MS, steady_ms * MS)


def overdue(sync: Synchroniser, now_ms: int, steady_ms: int = 1000_000) -> Fault | None:
    return sync.overdue(now_ms * MS, steady_ms * MS)


def frame(stamp_ms: int, odometry_ms: int | tuple[int, ...], area_ms: int) -> Frame:
    around = odometry_ms if isinstance(odometry_ms, tuple) else (odometry_ms,)
    return Frame(
        stamp_ms * MS,
        tuple(f"odometry {each}" for each in around),
        f"visible area {area_ms}",
        f"objects {stamp_ms}",
    )


def test_a_frame_is_due_as_soon_as_all_inputs_are_as_new_as_the_objects() -> None:
    sync = synchroniser()
    give(sync, OBJECTS, 100)
    give(sync, ODOMETRY, 110)
    assert take(sync) is None
    give(sync, AREA, 100)
    assert take(sync) == frame(100, 110, 100)


def test_a_frame_comes_out_once() -> None:
    sync = synchroniser()
    for source in (ODOMETRY, AREA, OBJECTS):
        give(sync, source, 100)
    assert take(sync) == frame(100, 100, 100)
    assert take(sync, steady_ms=1000) is None


def test_without_new_objects_nothing_is_due() -> None:
    sync = synchroniser()
    give(sync, ODOMETRY, 100)
    give(sync, AREA, 100)
    assert take(sync, steady_ms=1000) is None


def test_after_the_timeout_the_newest_there_is_serves() -> None:
    sync = synchroniser()
    give(sync, ODOMETRY, 60)
    give(sync, AREA, 40)
    give(sync, OBJECTS, 100, steady_ms=7000)
    assert take(sync, steady_ms=7049) is None
    assert take(sync, steady_ms=7050) == frame(100, 60, 40)


def test_of_inputs_that_went_on_those_that_belong_to_the_objects_serve() -> None:
    sync = synchroniser()
    for stamp_ms in range(0, 300, 20):
        give(sync, ODOMETRY, stamp_ms)
    for stamp_ms in range(30, 300, 50):
        give(sync, AREA, stamp_ms)
    give(sync, OBJECTS, 109)
    # An area that is newer than the objects shows too much.
    assert take(sync) == frame(109, (100, 120), 80)
    give(sync, OBJECTS, 131)
    assert take(sync) == frame(131, (120, 140), 130)
    give(sync, OBJECTS, 140)
    assert take(sync) == frame(140, 140, 130)


def test_a_new_errand_does_not_begin_where_the_ego_was_before() -> None:
    sync = synchroniser()
    for stamp_ms in (0, 100):
        give(sync, ODOMETRY, stamp_ms)
        give(sync, AREA, stamp_ms)
    sync.begin_errand()
    give(sync, OBJECTS, 40)
    assert isinstance(take(sync), Fault)
    give(sync, OBJECTS, 100)
    assert take(sync, steady_ms=50) == frame(100, 100, 100)


def test_an_odometry_far_ahead_of_the_objects_does_not_serve() -> None:
    sync = synchroniser()
    give(sync, AREA, 100)
    give(sync, ODOMETRY, 601)
    give(sync, OBJECTS, 100)
    fault = take(sync)
    assert isinstance(fault, Fault)
    assert fault.text == "no odometry within 0.5 s of the objects"


def test_late_objects_find_the_area_that_belongs_to_them_also_if_areas_run_ahead() -> None:
    # Each by nearly as much as it may: 0.42 s behind the clock, and 0.1 s ahead of it.
    sync = Synchroniser(SynchroniserConfig(), AgeLimits())
    arrivals = [(t, t, ODOMETRY) for t in range(0, 5000, 10)]
    arrivals += [(t + 420, t, OBJECTS) for t in range(0, 4600, 100)]
    arrivals += [(t - 95, t + 5, AREA) for t in range(100, 5000, 100)]
    due = []
    for now_ms, stamp_ms, source in sorted(arrivals, key=lambda each: each[0]):
        give(sync, source, stamp_ms, steady_ms=now_ms, now_ms=now_ms)
        due.append(take(sync, steady_ms=now_ms, now_ms=now_ms))
    assert sum(isinstance(each, Frame) for each in due) >= 40
    assert not [each for each in due[1500:] if isinstance(each, Fault)]


def test_an_area_that_is_newer_than_the_objects_does_not_serve_them() -> None:
    sync = synchroniser()
    give(sync, ODOMETRY, 100)
    give(sync, AREA, 110)
    give(sync, OBJECTS, 100)
    assert take(sync) == Fault(
        100 * MS,
        Status.MISSING_INPUT,
        FaultyInput.VISIBLE_AREA,
        "no visible area of the objects' time or before received yet",
    )
    give(sync, OBJECTS, 120)
    assert take(sync, steady_ms=50) == frame(120, 100, 110)


def test_an_area_that_is_too_old_for_the_objects_is_a_fault_also_once_the_next_has_come() -> None:
    sync = synchroniser()
    give(sync, AREA, 100)
    give(sync, AREA, 1100)
    give(sync, ODOMETRY, 1000)
    give(sync, OBJECTS, 1000)
    assert take(sync) == Fault(
        1000 * MS,
        Status.STALE_INPUT,
        FaultyInput.VISIBLE_AREA,
        "the last visible area before the objects is 0.90 s older, expected at most 0.5 s",
    )


def test_what_is_too_old_for_any_objects_is_not_kept() -> None:
    backlog = Backlog()
    for stamp_ns in range(0, 10_000, 10):
        backlog.add(Stamped(stamp_ns, None), max_age_ns=100)
    # Ten that are not too old, and one more in case that all of them are too new.
    assert len(backlog._messages) == 11
    assert backlog.up_to(9_889) is None
    backlog.forget_later_than(9_935)
    assert backlog.around(10_000) == [Stamped(9_930, None)]
    backlog.forget_later_than(0)
    assert backlog.around(10_000) == []
    for stamp_ns in range(5_000):
        backlog.add(Stamped(stamp_ns, None), max_age_ns=100_000)
    assert len(backlog._messages) == 2_000


def test_objects_that_keep_coming_do_not_put_the_deadline_off() -> None:
    sync = synchroniser()
    give(sync, ODOMETRY, 0)
    give(sync, AREA, 0)
    give(sync, OBJECTS, 100, steady_ms=100)
    give(sync, OBJECTS, 140, steady_ms=140)
    assert take(sync, steady_ms=149) is None
    assert take(sync, steady_ms=150) == frame(140, 0, 0)


def test_an_input_of_exactly_the_allowed_age_serves_and_an_older_one_is_a_fault() -> None:
    sync = synchroniser()
    give(sync, ODOMETRY, 1000)
    give(sync, AREA, 500)
    give(sync, OBJECTS, 1000)
    assert take(sync, steady_ms=50) == frame(1000, 1000, 500)
    give(sync, OBJECTS, 1010, steady_ms=60)
    assert take(sync, steady_ms=110) == Fault(
        1010 * MS,
        Status.STALE_INPUT,
        FaultyInput.VISIBLE_AREA,
        "visible area is 0.51 s old, expected at most 0.5 s",
    )


def test_what_never_came_is_named() -> None:
    sync = synchroniser()
    give(sync, OBJECTS, 100)
    assert take(sync, steady_ms=50) == Fault(
        100 * MS,
        Status.MISSING_INPUT,
        FaultyInput.ODOMETRY,
        "no odometry and no visible area received yet",
    )


def test_stamps_that_fall_are_a_fault_once_and_then_the_new_time_counts() -> None:
    sync = synchroniser()
    for source in (ODOMETRY, AREA, OBJECTS):
        give(sync, source, 1000)
    take(sync)
    give(sync, OBJECTS, 900)
    assert take(sync) == Fault(
        900 * MS,
        Status.OUT_OF_ORDER_INPUT,
        FaultyInput.OBJECTS,
        "objects went back in time by 0.100 s, expected rising stamps",
    )
    give(sync, OBJECTS, 1010)
    assert take(sync, steady_ms=50) == frame(1010, 1000, 1000)


def test_a_late_odometry_is_a_fault_even_though_the_objects_are_in_order() -> None:
    sync = synchroniser()
    give(sync, ODOMETRY, 1000)
    give(sync, ODOMETRY, 990)
    give(sync, AREA, 1000)
    give(sync, OBJECTS, 1000)
    fault = take(sync)
    assert isinstance(fault, Fault)
    assert fault.text.startswith("odometry went back in time")


def test_a_repeated_stamp_is_in_order() -> None:
    sync = synchroniser()
    for _ in range(2):
        for source in (ODOMETRY, AREA, OBJECTS):
            give(sync, source, 100)
        assert take(sync) == frame(100, 100, 100)


def test_inputs_that_have_stopped_are_overdue_by_the_clock_of_the_stamps() -> None:
    sync = synchroniser()
    assert overdue(sync, 0) == Fault(
        0,
        Status.MISSING_INPUT,
        FaultyInput.ODOMETRY,
        "no odometry and no visible area and no objects received yet",
    )
    for source in (ODOMETRY, AREA, OBJECTS):
        give(sync, source, 1000)
    assert overdue(sync, 1500) is None
    assert overdue(sync, 1501) == Fault(
        1501 * MS,
        Status.STALE_INPUT,
        FaultyInput.ODOMETRY,
        "odometry is 0.50 s old, expected at most 0.5 s",
    )


def test_inputs_ahead_of_the_clock_are_not_overdue() -> None:
    # In lock-step a frame is published before the clock reaches its time.
    sync = synchroniser()
    for source in (ODOMETRY, AREA, OBJECTS):
        give(sync, source, 1000)
    assert overdue(sync, 0) is None
    assert take(sync) == frame(1000, 1000, 1000)


def test_when_the_clock_jumps_back_the_new_time_starts_without_a_fault() -> None:
    sync = synchroniser()
    for source in (ODOMETRY, AREA, OBJECTS):
        give(sync, source, 60_000)
    take(sync)
    sync.clock_went_back(5000 * MS)
    assert sync.streams[OBJECTS].age_s(5000 * MS) is None
    for source in (ODOMETRY, AREA, OBJECTS):
        give(sync, source, 5000)
    assert take(sync) == frame(5000, 5000, 5000)


def test_when_the_clock_jumps_back_after_the_new_messages_they_are_kept() -> None:
    sync = synchroniser()
    give(sync, OBJECTS, 60_000)
    for source in (ODOMETRY, AREA, OBJECTS):
        give(sync, source, 5000)
    sync.clock_went_back(4900 * MS)
    assert take(sync) == frame(5000, 5000, 5000)


def test_objects_that_come_late_are_stale_by_the_clock() -> None:
    sync = synchroniser()
    for source in (ODOMETRY, AREA, OBJECTS):
        give(sync, source, 1000, now_ms=1600)
    assert take(sync, now_ms=1600) == Fault(
        1600 * MS, Status.STALE_INPUT, ODOMETRY, "odometry is 0.60 s old, expected at most 0.5 s"
    )


def test_an_input_far_ahead_of_the_clock_is_a_fault_for_as_long_as_it_is() -> None:
    ages = AgeLimits(max_input_age_s=0.5, max_input_ahead_s=0.2)
    sync = Synchroniser(SynchroniserConfig(), ages)
    give(sync, ODOMETRY, 9000, now_ms=1000)
    give(sync, AREA, 1000, now_ms=1000)
    expected = Fault(
        1200 * MS,
        Status.FUTURE_INPUT,
        ODOMETRY,
        "odometry is 8.00 s ahead of the clock, expected at most 0.2 s",
    )
    assert take(sync, now_ms=1000) == expected
    give(sync, OBJECTS, 1000, now_ms=1000)
    late = overdue(sync, 1000)
    assert late is not None
    assert (late.status, late.source) == (Status.FUTURE_INPUT, ODOMETRY)
    again = take(sync, now_ms=1000)
    assert isinstance(again, Fault)
    assert (again.status, again.source) == (Status.FUTURE_INPUT, ODOMETRY)


def test_faults_are_told_as_of_now_or_their_reader_would_doubt_them() -> None:
    sync = Synchroniser(SynchroniserConfig(), AgeLimits(0.5, 0.2))
    give(sync, OBJECTS, 5000, now_ms=5000)
    give(sync, OBJECTS, 100, now_ms=5000)
    fault = take(sync, now_ms=5000)
    assert isinstance(fault, Fault)
    assert (fault.stamp_ns, fault.status) == (5000 * MS, Status.OUT_OF_ORDER_INPUT)


def test_limits_may_change_while_it_runs() -> None:
    sync = synchroniser()
    for source in (ODOMETRY, AREA, OBJECTS):
        give(sync, source, 1000)
    sync.reconfigure(SynchroniserConfig(), AgeLimits(0.1, 0.2))
    assert overdue(sync, 1100) is None
    fault = overdue(sync, 1101)
    assert fault is not None
    assert fault.status is Status.STALE_INPUT


def test_after_a_restart_nothing_has_come_yet() -> None:
    sync = synchroniser()
    for source in (ODOMETRY, AREA, OBJECTS):
        give(sync, source, 1000)
    sync.restart()
    assert take(sync) is None
    fault = overdue(sync, 1000)
    assert fault is not None
    assert fault.status is Status.MISSING_INPUT


ARRIVALS = st.lists(st.tuples(st.sampled_from(INPUTS), st.integers(0, 400)), max_size=40)


@given(ARRIVALS)
def test_a_frame_never_holds_an_input_older_than_allowed(
    arrivals: list[tuple[FaultyInput, int]],
) -> None:
    sync = synchroniser()
    stamp = 0
    for steady, (source, step) in enumerate(arrivals):
        stamp += step
        sync.receive(source, stamp * MS, stamp, 0, steady * 100 * MS)
        due = take(sync, steady_ms=(steady + 1) * 100)
        if isinstance(due, Frame):
            assert due.objects == due.stamp_ns // MS
            for message in (due.odometry[-1], due.visible_area):
                assert isinstance(message, int)
                assert message >= due.stamp_ns // MS - 500
            assert due.visible_area <= due.objects
