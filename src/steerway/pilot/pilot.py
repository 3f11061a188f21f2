"""One step of the loop: estimate, guide, supervise, control. Simulation, replay and live runs share this class.

A pilot turns measurements and the time since the last step into actuator commands. It has no vessel model, clock or I/O
of its own; its blocks are arguments. An observer is called between the stages and chooses the mode: in simulation a
`Lookout`, on board the supervisor of links, clocks and fences. `build` makes pilots.
"""

import math
from typing import Protocol

from steerway.control.allocation import Actuation
from steerway.control.handover import Autopilot
from steerway.control.holding import PositionHold
from steerway.control.in_current import SURE, InCurrent
from steerway.control.spot_turn import SpotTurn
from steerway.control.station import StationKeeper
from steerway.core.checks import one_of, positive
from steerway.core.estimate import Estimate, Estimator, Measurements
from steerway.core.kinematics import heading_for
from steerway.core.leg import LegState
from steerway.core.reference import Reference
from steerway.guidance.line_of_sight import GuidanceLaw
from steerway.guidance.waypoints import Phase
from steerway.pilot.orders import LegSource, Mode, Orders, SpeedLoop, Steered

UNKNOWN = Reference(math.nan, 0.0, 0.0)
_LEAST_SHARE = 0.7
"""Lower limit of the speed through the water, as a fraction of the route's speed; `InCurrent.heading` has the same."""


class Observer(Protocol):
    """Called between the stages of a step: in simulation `Lookout`, on board `live.autopilot.supervisor.Supervisor`."""

    def judge(self, pilot: "Pilot", measurements: Measurements, estimate: Estimate, leg: LegState, dt: float) -> Mode:
        """After the leg is known: the mode of the pilot in this step."""

    def ask(
        self, pilot: "Pilot", desired: Reference, speed: float, estimate: Estimate
    ) -> tuple[Reference, float, Estimate]:
        """Before control: the course or heading, the speed (m/s) and the estimate that control uses."""

    def allows(self, pilot: "Pilot", steered: Steered, estimate: Estimate) -> bool:
        """After control: whether the commands may be sent to the actuators."""


class Lookout:
    """The observer of a simulation: stops the engines if positions are missing too long or there is no headway."""

    def __init__(self, max_dead_reckoning: float):
        self.max_dead_reckoning = positive("pilot.max_dead_reckoning", max_dead_reckoning)
        self._blind = 0.0

    def judge(self, pilot: "Pilot", measurements: Measurements, estimate: Estimate, leg: LegState, dt: float) -> Mode:
        """The mode, by the age of the last position, the mission's phase and the current."""
        pilot.measured_shaft(measurements.shaft)
        self._blind = 0.0 if not math.isnan(measurements.north) else self._blind + dt
        phase = pilot.mission.phase
        if math.isnan(estimate.north):
            return Mode.WAITING
        if self._blind > self.max_dead_reckoning:
            return Mode.BLIND
        if phase is Phase.STOPPED or (phase is Phase.HOLDING and pilot.station is None):
            return Mode.STOPPED
        if pilot.mode is Mode.OVERPOWERED or (pilot.in_current is not None and pilot.in_current.trouble):
            return Mode.OVERPOWERED
        return Mode.HOLDING if phase is Phase.HOLDING else Mode.UNDER_WAY

    def ask(
        self, pilot: "Pilot", desired: Reference, speed: float, estimate: Estimate
    ) -> tuple[Reference, float, Estimate]:
        """The arguments, unchanged."""
        return desired, speed, estimate

    def allows(self, pilot: "Pilot", steered: Steered, estimate: Estimate) -> bool:
        """Always True."""
        return True


class Pilot:
    """Steers a boat along a mission.

    estimator: measurements → estimate.
    mission:   position → current leg; may be replaced at any time.
    law:       leg → desired course, or heading.
    autopilot: course or heading → yaw moment, rudder angle or yaw rate.
    actuation: force and autopilot's output → commands.
    speed:     speed → surge force; without it no force is demanded.
    station:   holds a position where the mission asks for it; without it the pilot stops there. A `StationKeeper` needs
        a compass, a `PositionHold` an estimator that provides the current.
    cruise:    speed where the mission gives none, m/s.
    steer_by:  "course"; "heading" for a law that gives a heading; "crab": steer the heading that yields the course in
               the estimated current.
    in_current: if the estimator provides the current: steers the heading that yields the course, and begins turns
               early. If the law gives a heading, the course that this heading yields is steered; the gains of the law
               then compensate errors of the estimated current.
    spot_turn: with `in_current`, turns on the spot at corners; None: the boat turns under way.
    max_dead_reckoning: time without a position after which the engines stop, s.
    observer: replaces the default, a `Lookout` with that time.
    """

    def __init__(
        self,
        estimator: Estimator,
        mission: LegSource,
        law: GuidanceLaw,
        autopilot: Autopilot,
        actuation: Actuation,
        speed: SpeedLoop | None = None,
        station: StationKeeper | PositionHold | None = None,
        *,
        cruise: float = math.nan,
        steer_by: str = "course",
        in_current: InCurrent | None = None,
        spot_turn: SpotTurn | None = None,
        max_dead_reckoning: float = 10.0,
        observer: Observer | None = None,
    ):
        self.estimator, self.mission, self.law, self.autopilot = estimator, mission, law, autopilot
        self.actuation, self.speed, self.station = actuation, speed, station
        self.cruise = cruise
        self.in_current, self.spot_turn = in_current, spot_turn
        self.observer: Observer = observer or Lookout(max_dead_reckoning)
        self.mode = Mode.WAITING
        by_heading = one_of("pilot.steer_by", steer_by, ("course", "heading", "crab")) == "heading"
        self._law_of_course = not by_heading or in_current is not None
        self._turns_headings = by_heading and in_current is not None
        self._crabs = steer_by == "crab"
        self._turns = getattr(speed, "turns", None)  # for a speed loop that uses the measured shaft speed
        self._orders = getattr(estimator, "order", _no_order)  # for an estimator that uses the orders

    @property
    def finished(self) -> bool:
        """Whether the engines are off for good: the route is finished, or the current too strong for it."""
        return self.mode in (Mode.STOPPED, Mode.OVERPOWERED)

    def step(self, measurements: Measurements, dt: float) -> Orders:
        """The commands, dt s after the last step."""
        estimate = self.estimator.step(measurements, dt)
        leg = self.mission.step(estimate.north, estimate.east, dt)
        self._look_ahead(leg, estimate, dt)
        mode = self.observer.judge(self, measurements, estimate, leg, dt)
        if mode is not self.mode:
            self._change(mode)
        desired, speed = self._guide(leg, estimate, dt)
        desired, speed, used = self.observer.ask(self, desired, speed, estimate)
        if mode is Mode.UNDER_WAY:
            steered = self._steer(desired, speed, used, dt)
        elif mode is Mode.HOLDING:
            desired, steered = self._hold(desired, speed, leg, used, dt)
        else:
            steered = self._leave() if mode is Mode.IDLE else self._rest()
        if not self.observer.allows(self, steered, estimate):
            steered = self._leave()
        command, force, yaw, reference = steered
        by_course = self.autopilot.by_course
        return Orders(command, estimate, leg, desired, reference, speed, force, yaw, mode, by_course)

    def _guide(self, leg: LegState, estimate: Estimate, dt: float) -> tuple[Reference, float]:
        """The desired course (or heading) and speed (m/s); also while another program steers along the leg."""
        given = self.mission.given_course
        if math.isfinite(given):
            return Reference(given, 0.0, 0.0), leg.speed
        if self.mode not in (Mode.UNDER_WAY, Mode.IDLE) or math.isnan(leg.direction):
            return UNKNOWN, 0.0
        speed = self.cruise if math.isnan(leg.speed) else leg.speed
        dt = dt if self.mode is Mode.UNDER_WAY else 0.0  # else the law would integrate errors of another helmsman
        desired = self.law.step(self._seen(leg, speed, estimate), estimate.cog, estimate.sog, dt)
        if self.spot_turn is not None:
            speed = self.spot_turn.speed(leg, speed)
        elif self.in_current is not None and estimate.knows_current:
            speed = self.in_current.speed(leg, speed)
        if self.spot_turn is not None and self.spot_turn.turns:
            desired = Reference(leg.direction, 0.0, 0.0)
        elif self._turns_headings and estimate.knows_current:
            through = max(estimate.water_speed, _LEAST_SHARE * speed)
            north = through * math.cos(desired.angle) + estimate.current_north
            east = through * math.sin(desired.angle) + estimate.current_east
            desired = desired._replace(angle=math.atan2(east, north))
        return desired, speed

    def _steer(self, desired: Reference, speed: float, estimate: Estimate, dt: float) -> Steered:
        """The commands for a desired course (or heading) and speed (m/s)."""
        if self.in_current is not None and estimate.knows_current:
            return self._steer_in_current(self.in_current, desired, speed, estimate, dt)
        force = 0.0 if self.speed is None else self.speed.step(speed, estimate.sog, dt)
        if self._crabs and estimate.knows_current:
            current = estimate.current_north, estimate.current_east
            heading, _ = heading_for(desired.angle, estimate.water_speed, *current)
            return self._actuate(force, self._yaw(Reference(heading, 0.0, 0.0), estimate, dt, course_wanted=False))
        return self._actuate(force, self._yaw(desired, estimate, dt, self._law_of_course))

    def uses_current(self, estimate: Estimate) -> bool:
        """Whether the pilot steers a heading computed from the estimated current."""
        return estimate.knows_current and (self._crabs or self.in_current is not None)

    def measured_shaft(self, shaft: float) -> None:
        """Pass the measured shaft speed (rev/s, NaN for none) to a speed loop that uses it."""
        if self._turns is not None:
            self._turns(shaft)

    def _seen(self, leg: LegState, speed: float, estimate: Estimate) -> LegState:
        """The leg for the guidance law, in a current with a shorter lookahead; speed: of the route, m/s."""
        if self.in_current is None or not estimate.knows_current:
            return leg
        return self.in_current.with_shorter_lookahead(leg, speed, estimate)

    def _look_ahead(self, leg: LegState, estimate: Estimate, dt: float) -> None:
        """Set, for the mission's next step, the distance from the waypoint at which to turn into the next leg (`lead`)
        and the look-ahead distance on a curve (`preview`).

        Also watch whether the boat makes headway along the leg (`in_current.trouble`).
        """
        lead, following = math.nan, self.mission.following
        on_leg = self.mission.phase is not Phase.HOLDING and math.isnan(self.mission.given_course)
        if self.in_current is not None and estimate.knows_current and on_leg:
            self.in_current.watch(leg, estimate, dt)
            if estimate.heading_std < SURE and self.spot_turn is not None:
                lead = self.spot_turn.lead(leg, following, estimate, self.in_current.turn_rate)
            if math.isfinite(following) and math.isnan(lead) and estimate.heading_std < SURE:
                lead = self.in_current.turn(leg, following, estimate, self.autopilot.model)
        self.mission.lead = lead
        self.mission.preview = estimate.sog * self.autopilot.shaper.lag if estimate.sog > 0.0 else 0.0

    def _steer_in_current(
        self, steering: InCurrent, desired: Reference, speed: float, estimate: Estimate, dt: float
    ) -> Steered:
        speed = steering.water_speed(desired.angle, speed, estimate)
        heading = steering.heading(desired, speed, estimate, self.autopilot.shaper.reference)
        if self.spot_turn is not None and self.spot_turn.stays(heading.angle, estimate):
            speed = 0.0
        return self._through_water(steering, heading, speed, estimate, dt)

    def _through_water(
        self, steering: InCurrent, heading: Reference, speed: float, estimate: Estimate, dt: float
    ) -> Steered:
        """The commands for a heading and a speed through the water."""
        steering.tune(self.autopilot, estimate)
        force, reached = 0.0, 1.0
        if self.speed is not None:
            force = self.speed.step(speed, estimate.water_speed, dt, *steering.current_along_bow(estimate))
            reached = steering.reached(self.speed.speed_of(force), estimate)
        if steering.departs(estimate, dt):
            self.autopilot.release()
            return self._actuate(force, 0.0, reached=reached)
        yaw = self._yaw(heading, estimate, dt, course_wanted=False)
        return self._actuate(force, yaw, steering.feedforward(self.autopilot, estimate), reached)

    def _about(
        self, station: PositionHold, steering: InCurrent, leg: LegState, estimate: Estimate, dt: float
    ) -> Steered:
        """The commands that hold the boat near the waypoint of a leg."""
        wanted = station.step(leg.distance, leg.bearing, estimate)
        if wanted.water_speed == 0.0:
            if self.speed is not None:
                self.speed.restart()
            return self._rest()
        return self._through_water(steering, Reference(wanted.heading, 0.0, 0.0), wanted.water_speed, estimate, dt)

    def restart(self) -> None:
        """Reset integrals and reference: the next step under way starts from the boat's present course."""
        self.autopilot.release()
        self.autopilot.controller.restart()
        for each in (self.in_current, self.spot_turn, self.speed):
            if each is not None:
                each.restart()

    def _rest(self) -> Steered:
        """Neutral commands, engines off. The autopilot restarts with the next step under way."""
        self.autopilot.release()
        *command, _, _ = self.actuation.step(0.0, 0.0)
        self._orders(0.0, self.cruise if self.speed is None else 0.0)
        return Steered(tuple(command), 0.0, 0.0, self._reference())

    def _change(self, mode: Mode) -> None:
        """Enter a mode, with the integrals of the last mode reset."""
        if mode is Mode.HOLDING and self.station is not None:
            self.station.restart()
        if mode is Mode.HOLDING and self.in_current is not None:
            self.in_current.restart()
        if self.speed is not None and mode is not Mode.UNDER_WAY:
            self.speed.restart()
        self.mode = mode

    def _hold(
        self, desired: Reference, speed: float, leg: LegState, estimate: Estimate, dt: float
    ) -> tuple[Reference, Steered]:
        station, steering = self.station, self.in_current
        if isinstance(station, PositionHold):
            if steering is None or (math.isfinite(desired.angle) and not estimate.knows_current):
                return desired, self._steer(desired, speed, estimate, dt)
            steered = self._about(station, steering, leg, estimate, dt)
            return (steered.reference if math.isnan(desired.angle) else desired), steered
        if station is None:
            return desired, self._rest()
        sog, cog, heading = estimate.sog, estimate.cog, estimate.heading
        wanted, force = station.step(leg.distance, leg.bearing, cog, sog, heading, dt)
        desired = Reference(*wanted)
        return desired, self._actuate(force, self._yaw(desired, estimate, dt, course_wanted=False))

    def _leave(self) -> Steered:
        """No command, because another program or a person steers; the estimator's orders become NaN."""
        self._orders(math.nan, math.nan)
        return Steered((), 0.0, 0.0, self._reference())

    def _yaw(self, desired: Reference, estimate: Estimate, dt: float, course_wanted: bool) -> float:
        _, _, sog, cog, course_rate, _, _, _, _, heading, yaw_rate, *_ = estimate
        return self.autopilot.step(desired, cog, course_rate, heading, yaw_rate, sog, dt, course_wanted)

    def _actuate(self, force: float, yaw: float, fed: float = 0.0, reached: float = 1.0) -> Steered:
        """The commands for a force and the autopilot's output plus a feedforward `fed`; limits stop the integrals.

        reached: share of the force that a vehicle's own speed loop achieves.
        """
        *command, achieved_force, achieved_yaw = self.actuation.step(force, yaw + fed)
        self.autopilot.limited_to(achieved_yaw - fed)
        if self.speed is not None:
            self.speed.limited_to(reached * achieved_force)
        self._orders(achieved_yaw, self.cruise if self.speed is None else self.speed.speed_of(achieved_force))
        return Steered(tuple(command), force, yaw + fed, self._reference())

    def _reference(self) -> Reference:
        return self.autopilot.shaper.reference or UNKNOWN


def _no_order(yaw: float, speed: float) -> None:
    """For an estimator that does not use the orders."""
