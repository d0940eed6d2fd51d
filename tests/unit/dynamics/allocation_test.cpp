#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "layfigure/dynamics/step.h"
#include "scene.h"

namespace {
std::atomic<long> allocations{0};
}  // namespace

// Every way to the heap that C++ code has goes through these.
void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  ++allocations;
  const std::size_t align = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(align, (size + align - 1) / align * align)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace layfigure::dynamics {
namespace {

TEST(Step, AfterTheFirst_AllocatesNothing) {
  const testing::Scene scene =
      testing::pulled_chain({.links = 20, .bend = 0.3, .yield_torque = 0.05, .flow_damping = 0.02});
  const Model model(scene.definition);
  const testing::Pulls pulls(scene.pulls);
  const Coupling coupling{.body = 4, .stiffness = 100.0, .damping = 1.0};
  for (const int order : {1, 2, 3, 4}) {
    State state = initial_state(model);
    Workspace workspace(model);
    const Inputs inputs{.loads = &pulls, .couplings = {&coupling, 1}};
    ASSERT_EQ(step(model, state, workspace, inputs, {.step = 2e-3, .order = order}).status, StepStatus::kOk);
    const long before = allocations;
    int yielding = 0;
    for (int k = 0; k < 100; ++k) {
      yielding += step(model, state, workspace, inputs, {.step = 2e-3, .order = order}).yielding;
    }
    EXPECT_EQ(allocations - before, 0) << "order " << order;
    EXPECT_GT(yielding, 0) << "the scene must reach the flow law's code";
  }
}

}  // namespace
}  // namespace layfigure::dynamics
