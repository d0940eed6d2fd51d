#pragma once

#include <layfigure/reply_t.hpp>
#include <string>
#include <vector>

namespace layfigure::app {

/// Adds numbers to a reply under a name.
void add_result(reply_t& reply, std::string name, std::vector<double> values);

}  // namespace layfigure::app
