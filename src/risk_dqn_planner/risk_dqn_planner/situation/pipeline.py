# SPDX-License-Identifier: Apache-2.0
"""From a route and what is perceived to a report; every fault of the input becomes a status."""

from collections.abc import Callable

from risk_dqn_planner.errors import PlannerError
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.situation.builder import SituationBuilder
from risk_dqn_planner.situation.config import SituationConfig
from risk_dqn_planner.situation.inputs import Perception
from risk_dqn_planner.situation.report import (
    Fault,
    FaultyInput,
    SituationReport,
    Status,
    fault_of,
)

Route = tuple[int, ...]

# Models are small; this many routes are remembered so that a loop of errands builds each once.
_REMEMBERED_ROUTES = 16


class SituationPipeline:
    """Builds the model of a route when it is first asked for, and situations on it."""

    def __init__(
        self,
        build_model: Callable[[Route], IntersectionModel],
        config: SituationConfig | None = None,
    ) -> None:
        self._build_model = build_model
        self._config = config or SituationConfig()
        self._builders: dict[Route, SituationBuilder] = {}
        self._builder: SituationBuilder | None = None
        self.route: Route = ()
        self.route_stamp_ns = 0
        self.route_fault: PlannerError | None = None

    @property
    def model(self) -> IntersectionModel | None:
        """The selected route's model; None without a usable route."""
        return None if self._builder is None else self._builder.model

    def select(self, route: Route, stamp_ns: int = 0) -> None:
        """Take a route from now on; one that does not fit the map is reported, not raised.

        What the memory knows is of the errand before, and forgotten.
        """
        self.route, self.route_stamp_ns = route, stamp_ns
        self.route_fault, self._builder = None, None
        try:
            self._builder = self._builder_of(route)
            self._builder.forget()
        except PlannerError as error:
            self.route_fault = error

    def _builder_of(self, route: Route) -> SituationBuilder:
        if route not in self._builders:
            builder = SituationBuilder(self._build_model(route), self._config)
            while len(self._builders) >= _REMEMBERED_ROUTES:
                del self._builders[next(iter(self._builders))]
            self._builders[route] = builder
        return self._builders[route]

    @property
    def hidden_places(self) -> list[list[tuple[float, float]]]:
        """Where the memory says that hidden vehicles may be, by path; empty without a memory."""
        memory = None if self._builder is None else self._builder.memory
        return [] if memory is None else memory.intervals()

    def report(self, stamp_ns: int, seen: Perception) -> SituationReport:
        """Return the situation at the objects' time, or the input's fault."""
        if self._builder is None:
            return self.route_report(stamp_ns)
        try:
            situations = self._builder.build(*seen, time_s=1e-9 * stamp_ns)
        except PlannerError as error:
            return self.fault(fault_of(stamp_ns, error))
        return SituationReport(
            stamp_ns=stamp_ns,
            status=Status.OK,
            text="",
            route=self.route,
            route_stamp_ns=self.route_stamp_ns,
            stop_line_derived=self._builder.model.stop_line.derived,
            situations=situations,
        )

    def route_report(self, stamp_ns: int) -> SituationReport:
        """Return the report for as long as there is no usable route."""
        if self.route_fault is not None:
            return self.fault(fault_of(stamp_ns, self.route_fault))
        text = "no route received yet"
        return self.fault(Fault(stamp_ns, Status.MISSING_INPUT, FaultyInput.ROUTE, text))

    def fault(self, fault: Fault) -> SituationReport:
        """Return a report without a situation."""
        return SituationReport(
            stamp_ns=fault.stamp_ns,
            status=fault.status,
            source=fault.source,
            text=fault.text,
            route=self.route,
            route_stamp_ns=self.route_stamp_ns,
        )
