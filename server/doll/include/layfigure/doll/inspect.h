#pragma once

#include <string>

#include "layfigure/doll/doll.h"

namespace layfigure::doll {

/// What doll was built, for people: a table of bodies and joints, totals, and a line per warning. Ends with a newline.
[[nodiscard]] std::string inspect_text(const Doll& doll);

/// The same for programs: a JSON object {name, source_file, content_hash, bones, mass, root_pin, bodies: [{name,
/// parent, mass, com, inertia, section, stiffness, damping, flow_damping, yield_torque, hardening, axis_ratios}],
/// warnings}. SI units; com in the body's frame; inertia the principal moments about it; parent null for a root; an
/// elastic joint's yield_torque null; what is one number for each axis of the section in the order twist, bend about y,
/// bend about z; axis_ratios the multiples of stiffness, damping and yield_torque.
[[nodiscard]] std::string inspect_json(const Doll& doll);

}  // namespace layfigure::doll
