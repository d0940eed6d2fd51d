#pragma once

#include <functional>
#include <string>

namespace layfigure::character {

/// Runs `work` in a child process and returns what it returns, so that code that can crash or hang on hostile input
/// takes nothing with it. The child may use 300 s of CPU time; it prints nothing. Throws std::runtime_error: with the
/// message of the exception that `work` threw, or saying that it crashed or took too long, or std::system_error if
/// there can be no child. Costs a fork and a pipe. Other threads must hold no lock that `work` needs, apart from the
/// allocator's.
[[nodiscard]] std::string run_isolated(const std::function<std::string()>& work);

}  // namespace layfigure::character
