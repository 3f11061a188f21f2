"""Names for this package's tests; not part of the public API."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.estimation.estimator_tables import EstimatorSettings
    from steerway.formats.mcap import INPUT
    from steerway.live import addresses, build_service, n2k, uri
    from steerway.live.addresses import Context
    from steerway.live.autopilot import piloting
    from steerway.live.autopilot.fence import Fence, NoGo
    from steerway.live.autopilot.integrity import ReceiverMonitor, ResponseMonitor
    from steerway.live.autopilot.limits import LimitGuard, TurnLimit
    from steerway.live.autopilot.measured import MeasuredHeading, MeasuredSpeed, measured_speed
    from steerway.live.autopilot.mission import BoatTable, GeodeticRoute, Limits, MissionTable, OnStop
    from steerway.live.autopilot.piloting import PROPELLERS, YAW_RATE, boat_of, pilot_of
    from steerway.live.autopilot.supervisor import Supervisor
    from steerway.live.build_service import launch as launch_launch
    from steerway.live.build_service import warm
    from steerway.live.control_port import ControlPort, control_address
    from steerway.live.controls import Controls
    from steerway.live.helm import access, chart, page, page_process, server
    from steerway.live.helm.access import COOKIE, Gate, Places, Sessions
    from steerway.live.helm.make_view import ChartPlane, ellipse, view
    from steerway.live.helm.page_process import HelmPage
    from steerway.live.helm.view import History, View
    from steerway.live.helm.view_text import UNKNOWN, tone, words
    from steerway.live.learning import RecordedLearning
    from steerway.live.links.decoding import ReceiverDecoder, moment
    from steerway.live.links.file import FileSink
    from steerway.live.links.gpsd import GpsdDecoder
    from steerway.live.links.link import Feed
    from steerway.live.links.signalk import SignalKDecoder, connected
    from steerway.live.links.signalk import token_of as signalk_token_of
    from steerway.live.links.transport import Transport
    from steerway.live.mavlink.companion import Companion
    from steerway.live.mavlink.decoding import BootClock, MavlinkDecoder
    from steerway.live.mavlink.guided import Guided, Takeover
    from steerway.live.mavlink.link import MavlinkLink, RoverMode, dialect, key_of
    from steerway.live.mavlink.missions import MissionLink, MissionServer
    from steerway.live.mavlink.readiness import Readiness
    from steerway.live.n2k import CLAIM, NO_ADDRESS, REQUEST, AddressClaim, N2kDecoder, N2kDevice, name_of
    from steerway.live.navigator import Navigator
    from steerway.live.outputs import foxglove
    from steerway.live.outputs.lines import JsonLines, PropellerCommands, SentenceOutput, json_line
    from steerway.live.outputs.output import Rhythm
    from steerway.live.outputs.signalk_output import Deltas
    from steerway.live.outputs.table import TableFile
    from steerway.live.process import log_to_stderr
    from steerway.live.recording import ESTIMATE, ORDER, RAW, Recorder
    from steerway.live.replaying import ANOTHER_PROCESSOR, Replayed, replay
    from steerway.live.rows import UNDER_WAY, InputRow, Order, Row, State, believable, lost, rows_of
    from steerway.live.service import Service
    from steerway.live.settings import Settings
    from steerway.live.simulated.boat import InnerLoops, ReceiverFix, SimulatedBoat
    from steerway.live.simulated.rover import Rover
    from steerway.live.simulated.running import PropellerReceiver, RunningBoat
    from steerway.live.source_choice import SourceChoice
    from steerway.live.startup_buffer import LONGEST, StartupBuffer
    from steerway.live.tick_timing import Durations, FixClock, Pulse
    from steerway.live.uri import Address, address, checked
    from steerway.live.uri import token_of as address_token_of

__getattr__, __dir__ = on_demand(__name__)
