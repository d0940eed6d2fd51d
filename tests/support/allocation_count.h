#pragma once

namespace layfigure::testing {

/// Heap allocations that C++ code of this program has made so far: linking allocation_count.cpp replaces the operators
/// new.
[[nodiscard]] long allocation_count();

/// Those of this thread.
[[nodiscard]] long thread_allocation_count();

}  // namespace layfigure::testing
