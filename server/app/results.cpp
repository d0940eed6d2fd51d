#include "layfigure/app/results.h"

#include <utility>

namespace layfigure::app {

void add_result(reply_t& reply, std::string name, std::vector<double> values) {
  argument_t result{};
  result.name = std::move(name);
  result.value_count = static_cast<std::int32_t>(values.size());
  result.values = std::move(values);
  reply.results.push_back(std::move(result));
  reply.result_count = static_cast<std::int32_t>(reply.results.size());
}

}  // namespace layfigure::app
