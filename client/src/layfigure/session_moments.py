"""Checks the moments that a session's expectations name: each is in the session, and what is compared with
another moment is judged after it.
"""

from __future__ import annotations

from layfigure.errors import LayfigureError
from layfigure.expectation import Expectation, Moment, Rate
from layfigure.expectation_file import references
from layfigure.session import Expect, Mark, Session, timed
from layfigure.session_tables import TableReader

ROUNDING_S = 1e-9  # of durations that are summed


def check_moments(session: Session, tables: TableReader) -> None:
    """Raises the LayfigureError of `tables` for the first one that cannot be meant."""
    check = _Check(session, tables)
    for hand in session.hands:
        for action, time_s in timed(hand.actions):
            if isinstance(action, Expect):
                check.expectation(action.expectation, time_s, time_s)
    for expectation in session.expectations:
        assert expectation.window is not None
        check.expectation(expectation, expectation.window.first, expectation.window.last)


class _Check:
    def __init__(self, session: Session, tables: TableReader) -> None:
        self._tables = tables
        self._end_s = session.duration_s
        self._marks: dict[str, float] = {}
        for number, hand in enumerate(session.hands, 1):
            for action, time_s in timed(hand.actions):
                if isinstance(action, Mark):
                    self._add_mark(action.name, time_s, f"hand {number}")

    def expectation(self, expectation: Expectation, first: Moment, last: Moment) -> None:
        first_s, last_s = self._seconds(first, expectation), self._seconds(last, expectation)
        if last_s < first_s or (last_s == first_s and isinstance(expectation.quantity, Rate)):
            raise self._fault(expectation, f"ends at {last_s:g} s, but begins at {first_s:g} s")
        for moment in references(expectation.quantity):
            since_s = self._seconds(moment, expectation)
            if since_s > first_s:
                raise self._fault(
                    expectation, f"is judged from {first_s:g} s on, but compares with {since_s:g} s, which is later"
                )

    def _add_mark(self, name: str, time_s: float, where: str) -> None:
        if name in self._marks:
            raise self._tables.error(where, f"makes the mark '{name}' again; give each its own name")
        self._marks[name] = time_s

    def _seconds(self, moment: Moment, expectation: Expectation) -> float:
        if isinstance(moment, str):
            if moment not in self._marks:
                known = f"there are {', '.join(self._marks)}" if self._marks else "there is none"
                raise self._fault(expectation, f"names the mark '{moment}', which no step makes: {known}")
            return self._marks[moment]
        if moment > self._end_s + ROUNDING_S:
            raise self._fault(expectation, f"names {moment:g} s, but the session ends at {self._end_s:g} s")
        return moment

    def _fault(self, expectation: Expectation, what: str) -> LayfigureError:
        return self._tables.error(expectation.place, what, line=expectation.line)
