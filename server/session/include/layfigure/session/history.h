#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "layfigure/haptics/doll_memory.h"

namespace layfigure::session {

/// What was done to a doll, as a tree: undoing goes back towards the root, and what is done after that begins a branch
/// beside the one that was undone, which stays. A place in the tree is the doll as it was when it was last left; it has
/// a number of its own, larger than those of all older places, that no other one gets when it is forgotten.
class History {
 public:
  /// The most steps that are kept, of all branches; beyond it the oldest are forgotten. 5 MB for 60 bodies.
  static constexpr std::size_t kMaxSteps = 256;

  struct Move {
    std::string label;           ///< of the step that was undone or done again, or that leads to the place gone to
    haptics::DollMemory memory;  ///< of the doll there
  };

  /// Something is about to be done to the doll, which is `before` now.
  void begin(std::string label, haptics::DollMemory before);
  /// Back to before the newest step; the doll is `now`. Nothing if there is none.
  [[nodiscard]] std::optional<Move> undo(haptics::DollMemory now);
  /// On along `branch`, of branches() in the order in which they began; by default the one that was undone last.
  /// Nothing if there is none.
  [[nodiscard]] std::optional<Move> redo(std::optional<std::size_t> branch);
  /// To any place, back and on through the tree; the doll is `now`. Nothing if there is no such place. O(steps).
  [[nodiscard]] std::optional<Move> go(std::int64_t place, haptics::DollMemory now);

  /// The number of where the doll is; at first 0.
  [[nodiscard]] std::int64_t place() const { return current_; }
  /// False for a place that never was, or is forgotten.
  [[nodiscard]] bool has(std::int64_t place) const { return nodes_.contains(place); }

  /// Steps that can be undone.
  [[nodiscard]] std::size_t undoable() const;
  /// The labels of the ways on from here.
  [[nodiscard]] std::vector<std::string> branches() const;
  /// The newest step, "" at the root.
  [[nodiscard]] const std::string& label() const { return at(current_).label; }
  /// Nothing was undone since the newest step.
  [[nodiscard]] bool at_end() const { return at(current_).next.empty(); }

 private:
  struct Node {
    std::int64_t parent{-1};         ///< -1: the root
    std::vector<std::int64_t> next;  ///< in the order in which they began
    std::int64_t undone{-1};         ///< of them, the one that was undone last
    std::string label;               ///< of the step that led here
    haptics::DollMemory memory;
  };

  [[nodiscard]] const Node& at(std::int64_t id) const { return nodes_.at(id); }
  void forget_oldest();
  void forget_branch(std::int64_t id);

  std::map<std::int64_t, Node> nodes_{{0, {}}};  ///< by id; ids grow with time
  std::int64_t root_{0};
  std::int64_t current_{0};
  std::int64_t next_id_{1};
};

}  // namespace layfigure::session
