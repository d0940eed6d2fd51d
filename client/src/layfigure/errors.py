"""What goes wrong outside of this program. Each message is one line that names the thing, the value and the mend."""


class LayfigureError(Exception):
    """Base of all errors that a user meets; the command line prints it and exits with 1."""


class UsageError(LayfigureError):
    """A bad option or argument; the command line exits with 2."""


class ProtocolError(LayfigureError):
    """A message that cannot be decoded, has the wrong version or holds impossible values."""


class BusError(LayfigureError):
    """The bus cannot be reached, or the connection to it is lost."""


class NoReplyError(LayfigureError):
    """No server answered in time."""


class RefusedError(LayfigureError):
    """The server answered a command with a refusal; the message is its reason."""


class TwoServersError(LayfigureError):
    """Two servers speak on one bus at the same time."""


class SpillError(LayfigureError):
    """The disk has no place for what a growing take keeps there."""
