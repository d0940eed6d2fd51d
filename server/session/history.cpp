#include "layfigure/session/history.h"

#include <algorithm>
#include <utility>

namespace layfigure::session {

void History::begin(std::string label, haptics::DollMemory before) {
  Node& here = nodes_.at(current_);
  here.memory = std::move(before);
  here.next.push_back(next_id_);
  here.undone = next_id_;
  nodes_.emplace(next_id_, Node{.parent = current_, .next = {}, .label = std::move(label), .memory = {}});
  current_ = next_id_++;
  if (nodes_.size() > kMaxSteps + 1) forget_oldest();
}

std::optional<History::Move> History::undo(haptics::DollMemory now) {
  if (current_ == root_) return std::nullopt;
  Node& left = nodes_.at(current_);
  left.memory = std::move(now);
  Node& back = nodes_.at(left.parent);
  back.undone = current_;
  current_ = left.parent;
  return Move{left.label, back.memory};
}

std::optional<History::Move> History::redo(std::optional<std::size_t> branch) {
  const Node& here = at(current_);
  if (here.next.empty() || (branch && *branch >= here.next.size())) return std::nullopt;
  current_ = branch ? here.next[*branch] : here.undone;
  return Move{at(current_).label, at(current_).memory};
}

std::optional<History::Move> History::go(std::int64_t place, haptics::DollMemory now) {
  if (!has(place)) return std::nullopt;
  nodes_.at(current_).memory = std::move(now);
  // A redo on the way back shall lead here again; nearer to the root than the ways part, it does so already.
  for (std::int64_t id = current_; id != root_; id = at(id).parent) nodes_.at(at(id).parent).undone = id;
  current_ = place;
  return Move{at(place).label, at(place).memory};
}

std::size_t History::undoable() const {
  std::size_t steps = 0;
  for (std::int64_t id = current_; id != root_; id = at(id).parent) ++steps;
  return steps;
}

std::vector<std::string> History::branches() const {
  std::vector<std::string> labels;
  for (const std::int64_t id : at(current_).next) labels.push_back(at(id).label);
  return labels;
}

/// The root's oldest branch if the way to the present does not go along it, else the root itself.
void History::forget_oldest() {
  const std::int64_t oldest = at(root_).next.front();
  std::int64_t way = current_;
  while (way != root_ && at(way).parent != root_) way = at(way).parent;
  if (oldest != way) return forget_branch(oldest);
  for (const std::int64_t other : std::vector<std::int64_t>(at(root_).next)) {
    if (other != way) forget_branch(other);
  }
  nodes_.erase(root_);
  root_ = way;
  nodes_.at(root_).parent = -1;
  nodes_.at(root_).label.clear();
}

void History::forget_branch(std::int64_t id) {
  std::vector<std::int64_t> left{id};
  std::erase(nodes_.at(at(id).parent).next, id);
  while (!left.empty()) {
    const std::int64_t gone = left.back();
    left.pop_back();
    left.insert(left.end(), at(gone).next.begin(), at(gone).next.end());
    nodes_.erase(gone);
  }
}

}  // namespace layfigure::session
