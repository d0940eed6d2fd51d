"""What became of sessions and their expectations: lines for people, JUnit XML for continuous integration."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from layfigure.errors import LayfigureError
from layfigure.expectation import describe, describe_bounds, is_boolean
from layfigure.judge import Verdict


@dataclass(frozen=True)
class Played:
    path: Path
    title: str
    played_s: float
    verdicts: tuple[Verdict, ...]
    error: str = ""  # why it was not played to its end
    lost: bool = False  # because the server is gone

    @property
    def failures(self) -> tuple[Verdict, ...]:
        return tuple(verdict for verdict in self.verdicts if not verdict.fulfilled)


def failure_line(path: Path, verdict: Verdict) -> str:
    """Where it stands in the file, when, what was expected, what was seen, and by how much it is off."""
    expectation = verdict.expectation
    line = "" if expectation.line is None else f":{expectation.line}"
    name = f" '{expectation.name}'" if expectation.name else ""
    when = "" if verdict.time_s is None else f" at {verdict.time_s:.3f} s"
    return f"{path}{line}: {expectation.place}{name}{when}: {_difference(verdict)}"


def summary(sessions: Sequence[Played]) -> str:
    expectations = sum(len(played.verdicts) for played in sessions)
    failed = sum(len(played.failures) for played in sessions)
    text = f"{expectations} expectation{'s' if expectations != 1 else ''}, {failed} failed"
    broken = sum(bool(played.error) for played in sessions)
    return text + (f"; {broken} of {len(sessions)} sessions not played to the end" if broken else "")


def _difference(verdict: Verdict) -> str:
    quantity = verdict.expectation.quantity
    expected = f"expected {describe(quantity)} {describe_bounds(verdict.expectation)}"
    if math.isnan(verdict.excess) or is_boolean(quantity):
        return f"{expected}, but {verdict.seen.detail}"
    unit = f" {quantity.unit}" if quantity.unit else ""
    detail = f" ({verdict.seen.detail})" if verdict.seen.detail else ""
    side = "too much" if verdict.excess > 0.0 else "too little"
    return f"{expected}, saw {verdict.seen.value:.5g}{unit}{detail}: {abs(verdict.excess):.3g}{unit} {side}"


def write_junit(path: Path, sessions: Sequence[Played]) -> None:
    """A suite for each session, a case for each expectation; a session that broke off is a case with an error.

    The form that Jenkins, GitLab and GitHub's reporters read. Raises LayfigureError if
    the file cannot be written.
    """
    root = ET.Element("testsuites")
    for played in sessions:
        root.append(_suite(played))
    ET.indent(root)
    try:
        ET.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)
    except OSError as error:
        raise LayfigureError(f"cannot write '{path}': {error.strerror}") from error


def _suite(played: Played) -> ET.Element:
    suite = ET.Element("testsuite", name=_legal(played.title or played.path.stem))
    suite.set("tests", str(len(played.verdicts) + 1))
    suite.set("failures", str(len(played.failures)))
    suite.set("errors", str(int(bool(played.error))))
    suite.set("time", f"{played.played_s:.3f}")
    session = _case(suite, played, "the session is played")
    if played.error:
        ET.SubElement(session, "error", message=_legal(played.error))
    for verdict in played.verdicts:
        expectation = verdict.expectation
        case = _case(suite, played, f"{expectation.place}: {expectation.name or describe(expectation.quantity)}")
        if not verdict.fulfilled:
            failure = ET.SubElement(case, "failure", message=_legal(_difference(verdict)))
            failure.text = _legal(failure_line(played.path, verdict))
    return suite


def _case(suite: ET.Element, played: Played, name: str) -> ET.Element:
    return ET.SubElement(suite, "testcase", classname=_legal(str(played.path)), name=_legal(name))


def _legal(text: str) -> str:
    """Without the characters that XML 1.0 has no way to write."""
    legal = (
        c if c in "\t\n\r" or " " <= c <= "\ud7ff" or "\ue000" <= c <= "\ufffd" or c > "\uffff" else "?" for c in text
    )
    return "".join(legal)
