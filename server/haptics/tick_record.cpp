#include "layfigure/haptics/tick_record.h"

#include <algorithm>
#include <cmath>

namespace layfigure::haptics {
namespace {

using Durations = std::array<std::int64_t, TickRecord::kBins>;

double upper_edge_us(int bin) {
  return 1e6 * TickRecord::kFirstBin * std::exp2(static_cast<double>(bin) / TickRecord::kBinsPerOctave);
}

/// The least bin with so large a share of all at or below it.
double quantile_us(const Durations& durations, double share) {
  std::int64_t total = 0;
  for (const std::int64_t count : durations) total += count;
  if (total == 0) return 0.0;
  const auto wanted = static_cast<std::int64_t>(std::ceil(share * static_cast<double>(total)));
  std::int64_t below = 0;
  for (int bin = 0; bin < TickRecord::kBins; ++bin) {
    below += durations[bin];
    if (below >= wanted) return upper_edge_us(bin);
  }
  return upper_edge_us(TickRecord::kBins - 1);
}

}  // namespace

void TickRecord::add(double duration, int periods) noexcept {
  ++ticks;
  if (periods > 1) ++late;
  missed += periods - 1;
  const double octaves = std::log2(std::max(duration, kFirstBin) / kFirstBin);
  ++durations[std::min(static_cast<int>(std::ceil(kBinsPerOctave * octaves)), kBins - 1)];
}

void TickWindow::update(const TickRecord& record, double time) {
  newest_ = {.record = record, .time = time};
  if (!begin_) {
    begin_ = middle_ = newest_;
  } else if (time - middle_.time >= kLength) {
    begin_ = middle_;
    middle_ = newest_;
  }
}

TickSummary TickWindow::summary() const {
  if (!begin_ || !(newest_.time > begin_->time)) return {};
  Durations durations = newest_.record.durations;
  for (int bin = 0; bin < TickRecord::kBins; ++bin) durations[bin] -= begin_->record.durations[bin];
  return {.rate_hz = static_cast<double>(newest_.record.ticks - begin_->record.ticks) / (newest_.time - begin_->time),
          .us_p50 = quantile_us(durations, 0.5),
          .us_p99 = quantile_us(durations, 0.99),
          .us_max = quantile_us(durations, 1.0)};
}

}  // namespace layfigure::haptics
