#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace layfigure::character {

/// What a child process may use.
struct ChildLimits {
  std::uint64_t seconds;  ///< of CPU time
  std::uint64_t memory;   ///< of address space [bytes], the parent's at the time included; not enforced in a build with
                          ///< a sanitizer, whose own tables are larger than any such limit
};

/// Runs `work` in a child process and returns what it returns, so that code that can crash or hang on hostile input
/// takes nothing with it; the child prints nothing. Throws std::runtime_error: with the message of the exception that
/// `work` threw, or saying that it crashed or was stopped at a limit, or std::system_error if there can be no child.
/// Costs a fork and a pipe. Other threads must hold no lock that `work` needs, apart from the allocator's.
[[nodiscard]] std::string run_isolated(const std::function<std::string()>& work, const ChildLimits& limits);

}  // namespace layfigure::character
