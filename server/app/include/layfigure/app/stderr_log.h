#pragma once

#include <string>

namespace layfigure::app {

/// Leads spdlog's lines to stderr, each as "NAME: line", without ever waiting: a line is left out if whoever reads a
/// pipe there has stopped to, so that it is full. A server that a program has started, and that this program does not
/// listen to, goes on. From any thread.
void log_to_stderr(const std::string& name);

}  // namespace layfigure::app
