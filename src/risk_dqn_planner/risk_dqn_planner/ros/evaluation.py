# SPDX-License-Identifier: Apache-2.0
"""From messages that belong together to a report: convert, doubt, call the core."""

import traceback
from collections.abc import Callable

from risk_dqn_planner.errors import PlannerError, RouteError
from risk_dqn_planner.ros import conversions
from risk_dqn_planner.ros.adapters.kinds import ObjectsAdapter
from risk_dqn_planner.ros.parameters import EgoParameters, MapParameters
from risk_dqn_planner.ros.streams import SECOND_NS
from risk_dqn_planner.ros.synchroniser import Frame
from risk_dqn_planner.situation.ego import between, carried_on
from risk_dqn_planner.situation.inputs import Perception
from risk_dqn_planner.situation.pipeline import Route, SituationPipeline
from risk_dqn_planner.situation.plausibility import Plausibility
from risk_dqn_planner.situation.report import (
    Fault,
    FaultyInput,
    SituationReport,
    Status,
    fault_of,
)

_NOBODY = FaultyInput.NO_INPUT


class Evaluation:
    """Makes reports of frames on the route of the present errand."""

    def __init__(
        self,
        maps: MapParameters,
        ego: EgoParameters,
        objects: ObjectsAdapter,
        pipeline: SituationPipeline,
        plausibility: Plausibility,
        complain: Callable[[str], None],
    ) -> None:
        """`complain` is told of errors that no input should cause."""
        self._maps = maps
        self._ego = ego
        self._objects = objects
        self.pipeline = pipeline
        self.plausibility = plausibility
        self._complain = complain

    def begin(self, route: Route, stamp_ns: int) -> bool:
        """Take a route; tell whether it is a new errand, on which the ego may be anywhere."""
        if (route, stamp_ns) == (self.pipeline.route, self.pipeline.route_stamp_ns):
            return False
        try:
            self.pipeline.select(route, stamp_ns)
        except Exception as error:  # noqa: BLE001 (a vehicle stops, whatever a route does)
            self._complain(traceback.format_exc())
            text = f"internal error: {' '.join(repr(error).split())}"
            self.pipeline.route_fault = RouteError(text, kind=Status.INTERNAL_ERROR)
        self.plausibility.forget()
        return True

    def report(self, frame: Frame) -> tuple[SituationReport, Perception | None]:
        """Return the situation of a frame and what it was made of, or why there is none."""
        try:
            frame_id, to_center_m = self._maps.map_frame, self._ego.base_to_center_m
            odometry, *beyond = frame.odometry
            seen = conversions.perception_from_messages(
                odometry, frame.visible_area, frame.objects, frame_id, to_center_m, self._objects
            )
            own_ns = conversions.to_ns(odometry.header.stamp)
            self.plausibility.check(seen, own_ns / SECOND_NS, frame.stamp_ns / SECOND_NS)
            later_s = (frame.stamp_ns - own_ns) / SECOND_NS
            if beyond:
                conversions.check_frame(beyond[0].header, frame_id, FaultyInput.ODOMETRY)
                after = conversions.ego_from_message(beyond[0], to_center_m)
                after_ns = conversions.to_ns(beyond[0].header.stamp)
                self.plausibility.check_next_ego(after, after_ns / SECOND_NS)
                share = (frame.stamp_ns - own_ns) / (after_ns - own_ns)
                seen = seen._replace(ego=between(seen.ego, after, share))
            elif later_s:
                seen = seen._replace(ego=carried_on(seen.ego, later_s))
            return self.pipeline.report(frame.stamp_ns, seen), seen
        except PlannerError as error:
            return self.fault(fault_of(frame.stamp_ns, error)), None
        except Exception as error:  # noqa: BLE001 (a vehicle stops, whatever an input does)
            self._complain(traceback.format_exc())
            text = f"internal error: {' '.join(repr(error).split())}"
            fault = Fault(frame.stamp_ns, Status.INTERNAL_ERROR, _NOBODY, text)
            return self.fault(fault), None

    def fault(self, fault: Fault) -> SituationReport:
        """Return a report without a situation."""
        return self.pipeline.fault(fault)
