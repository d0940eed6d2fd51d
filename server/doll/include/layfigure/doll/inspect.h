#pragma once

#include <string>

#include "layfigure/doll/doll.h"

namespace layfigure::doll {

/// What doll was built, for people: where its settings come from, a table of bodies and joints in which each number's
/// origin is marked, totals, the bones that ride on others' bodies and why, and a line per warning. Ends with a
/// newline.
[[nodiscard]] std::string inspect_text(const Doll& doll);

/// The same for programs: a JSON object
///     {name, source_file, content_hash, settings, bones, mass, root_pin, bodies, merged, warnings}
///     settings: {source (null: default), total_mass (null: none), material and each number of DollSettings by its
///               name, and reasons: why each of these is what it is}
///     bodies:   [{name, parent, mass, density, com, inertia, section, stiffness, damping, flow_damping, yield_torque,
///               hardening, axis_ratios, limits, locked, shape, friction, reasons}]
///     limits:   null or {twist, swing_y, swing_z, axes, reference}, ranges as [lower, upper], quaternions w x y z
///     axis_ratios: multiples of stiffness, damping and yield_torque, as all that is one number for each axis of the
///               section in the order twist, bend about y, bend about z
///     merged:   [{bone, body, reason}], bones that ride on a body (null: on none)
///     reasons:  why each number is what it is, in a few words, under the number's name
/// SI units, angles in radians; com in the body's frame; inertia the principal moments about it; parent null for a
/// root; what is infinite is null. Keys are only ever added.
///
/// With geometry also {geometry: {vertices, triangles, body_of_triangle, bodies: [{com, semi_axes, section}]}}: the
/// skin in the bind pose, world axes; the body that each triangle counts to (-1: none); the semi-axes of the ellipsoid
/// with the body's mass and inertia; the closed outline of the section at its joint (empty: estimated).
[[nodiscard]] std::string inspect_json(const Doll& doll, bool with_geometry = false);

}  // namespace layfigure::doll
