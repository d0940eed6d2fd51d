"""Everything that touches lcm: the bus, and event logs."""

from layfigure.bus.bus import Bus, default_url
from layfigure.bus.event_log import Event, EventLogWriter, is_being_written, read_events
from layfigure.bus.time_limit import TimeLimit

__all__ = ["Bus", "Event", "EventLogWriter", "TimeLimit", "default_url", "is_being_written", "read_events"]
