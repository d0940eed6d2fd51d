"""Checks a USD file: with USD's own validators, and for what they miss of skeletons.

Files of any tool can be checked. What USD allows, but is better not done, is a warning there, and an error in a take of
Layfigure's own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pxr import Sdf, Tf, Usd, UsdGeom, UsdSkel, UsdUtils, UsdValidation

from layfigure.usd.findings import Finding, error, warning
from layfigure.usd.mesh_checks import mesh_findings
from layfigure.usd.skeleton_checks import skeleton_findings
from layfigure.usd.stage import missing_layers, open_as_it_is, quiet

_MISSING_FILE = frozenset({"UnresolvableDependency", "CompositionError"})  # we name the files ourselves, once


@dataclass(frozen=True)
class Report:
    validators: int
    skeletons: int
    frames: int
    findings: tuple[Finding, ...]  # errors first

    @property
    def error_count(self) -> int:
        return sum(finding.is_error for finding in self.findings)


def check(path: Path) -> Report:
    """Raises LayfigureError if the file cannot be opened."""
    with quiet():
        return _check(path)


def _check(path: Path) -> Report:
    stage = open_as_it_is(path)
    prims = list(Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()))
    skeletons = [UsdSkel.Skeleton(prim) for prim in prims if prim.IsA(UsdSkel.Skeleton)]
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    missing = [
        error(path, f"needs the file '{name}', which is missing or cannot be read")
        for name in sorted(_missing_files(stage, path))
    ]
    findings = missing + list(_usd_findings(stage, validators, bool(missing)))
    findings += _stage_findings(stage)
    if not skeletons:
        findings.append(error(path, "holds no skeleton"))
    for skeleton in skeletons:
        findings += skeleton_findings(skeleton)
    for prim in prims:
        if prim.IsA(UsdGeom.Mesh):
            findings += mesh_findings(UsdGeom.Mesh(prim))
    if any(skeleton.GetPrim().HasCustomDataKey("layfigure") for skeleton in skeletons):
        findings = [replace(finding, is_error=True) for finding in findings]
    frames = max(round(stage.GetEndTimeCode() - stage.GetStartTimeCode()) + 1, 0)
    ordered = sorted(findings, key=lambda finding: not finding.is_error)
    return Report(len(validators), len(skeletons), frames, tuple(ordered))


def _missing_files(stage: Any, path: Path) -> set[str]:
    """Layers and textures."""
    layers = missing_layers(stage)
    if layers:
        return layers  # USD cannot tell the others beside layers that are broken
    return set(UsdUtils.ComputeAllDependencies(Sdf.AssetPath(str(path)))[2])


def _usd_findings(stage: Any, validators: Any, file_is_missing: bool) -> Iterator[Finding]:
    try:
        all_found = UsdValidation.ValidationContext(validators).Validate(stage)
    except Tf.ErrorException:
        if file_is_missing:
            return  # a layer that is broken ends them all, and is told
        raise
    for found in all_found:
        if file_is_missing and found.GetName() in _MISSING_FILE:
            continue
        sites = ", ".join(_site_name(site) for site in found.GetSites())
        what = f"{' '.join(found.GetMessage().split())} ({found.GetName()})"
        broken = found.GetType() == UsdValidation.ValidationErrorType.Error
        yield Finding(sites or stage.GetRootLayer().GetDisplayName(), what, broken)


def _site_name(site: Any) -> str:
    if site.IsPrim():
        return str(site.GetPrim().GetPath())
    if site.IsProperty():
        return str(site.GetProperty().GetPath())
    layer = site.GetLayer()
    return str(layer.GetDisplayName()) if layer else "stage"


def _stage_findings(stage: Any) -> Iterator[Finding]:
    layer = stage.GetRootLayer()
    where = layer.GetDisplayName()
    needed = ("defaultPrim", "metersPerUnit", "upAxis", "timeCodesPerSecond", "framesPerSecond")
    for name in (*needed, "startTimeCode", "endTimeCode"):
        if not stage.HasAuthoredMetadata(name):
            yield warning(where, f"{name} is not set")
    if stage.GetTimeCodesPerSecond() != stage.GetFramesPerSecond():
        yield warning(where, "timeCodesPerSecond and framesPerSecond differ: frames would not be time codes")
    if stage.GetEndTimeCode() < stage.GetStartTimeCode():
        yield error(where, "endTimeCode is before startTimeCode")
    if stage.GetDefaultPrim() and not Usd.ModelAPI(stage.GetDefaultPrim()).GetKind():
        yield warning(stage.GetDefaultPrim().GetPath(), "has no kind")
