#include "figures.h"

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

namespace layfigure::bench {
namespace {

void print_json(std::span<const Figure> figures) {
  auto list = nlohmann::ordered_json::array();
  for (const Figure& figure : figures) {
    nlohmann::ordered_json target;
    if (figure.target) target = *figure.target;
    list.push_back({{"name", figure.name},
                    {"value", figure.value},
                    {"unit", figure.unit},
                    {"target", target},
                    {"holds", holds(figure)}});
  }
  std::cout << list.dump(1) << "\n";
}

void print_table(std::span<const Figure> figures) {
  std::size_t width = 4;
  for (const Figure& figure : figures) width = std::max(width, figure.name.size());
  const int columns = static_cast<int>(width);
  std::printf("%-*s %12s %-6s %12s %s\n", columns, "name", "value", "unit", "target", "holds");
  for (const Figure& figure : figures) {
    std::printf("%-*s %12.4g %-6s", columns, figure.name.c_str(), figure.value, figure.unit.c_str());
    if (figure.target) std::printf(" %12.4g %s", *figure.target, holds(figure) ? "yes" : "no");
    std::printf("\n");
  }
}

}  // namespace

bool holds(const Figure& figure) { return !figure.target || figure.value <= *figure.target; }

void print(std::span<const Figure> figures, bool json) { json ? print_json(figures) : print_table(figures); }

}  // namespace layfigure::bench
