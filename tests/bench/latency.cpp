#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <random>
#include <stdexcept>
#include <thread>

#include "bus_client.h"
#include "figures.h"
#include "server_process.h"
#include "subjects.h"

namespace layfigure::bench {
namespace {

using std::chrono::milliseconds;

constexpr const char* kMulticast = "udpm://239.255.76.67:7667?ttl=0";
constexpr double kStroke = 0.005;  // [m] of the pointer: the doll follows and nothing gives way for good
// Longer than a pointer glides to a new place (50 ms), so that each motion begins from rest; and at random against the
// steps.
constexpr std::chrono::microseconds kShortestWait{70'000};
constexpr int kWaitSpreadUs = 10'000;
constexpr int kSubscribers = 10;  // of which one has stopped and one is slow
constexpr double kPoseHz = 240.0;

struct LatencyEffort {
  int samples;     ///< pointer messages on each bus
  double seconds;  ///< of poses to the subscribers
};
constexpr LatencyEffort kWhole{.samples = 1500, .seconds = 60.0};
constexpr LatencyEffort kQuick{.samples = 50, .seconds = 2.0};

const LatencyEffort& effort_of(const LatencyOptions& options) { return options.quick ? kQuick : kWhole; }

double milliseconds_of(Clock::duration time) { return std::chrono::duration<double, std::milli>(time).count(); }

/// Sorts; nan if there is none.
double percentile(std::vector<double>& values, double fraction) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(std::lround(fraction * static_cast<double>(values.size() - 1)))];
}

/// From a pointer's message to the first pose that contains its effect [ms].
void tell_latency(const LatencyOptions& options, const std::string& bus, std::vector<std::string> bus_options,
                  std::vector<Figure>& figures) {
  std::vector<std::string> arguments{options.character, "--pose-hz", "1000"};
  arguments.insert(arguments.end(), bus_options.begin(), bus_options.end());
  const ServerProcess server(options.server, arguments);
  BusClient client(server.url());
  std::array<double, 3> place = client.grab();
  std::mt19937 random(1);
  std::vector<double> latencies;
  int lost = 0;
  for (int k = 0; k < effort_of(options).samples; ++k) {
    std::this_thread::sleep_for(kShortestWait + std::chrono::microseconds(random() % kWaitSpreadUs));
    place[2] += k % 2 == 0 ? kStroke : -kStroke;
    const Clock::time_point sent = client.point(place);
    if (const auto seen = client.wait_for_effect()) {
      latencies.push_back(milliseconds_of(*seen - sent));
    } else {
      ++lost;
    }
  }
  const std::string name = "pointer to pose, " + bus;
  figures.push_back({name + ", p50", percentile(latencies, 0.5), "ms", 1.2});
  figures.push_back({name + ", p99", percentile(latencies, 0.99), "ms", 3.0});
  figures.push_back({name + ", max", percentile(latencies, 1.0), "ms"});
  figures.push_back({name + ", without an effect", static_cast<double>(lost), "", 0.0});
}

/// The time between which all subscribers are asked for what they got.
struct Window {
  std::int64_t first;  ///< sequence of a pose
  std::int64_t last;
};

/// Poses of the window that did not come.
std::int64_t missing(const std::vector<PoseArrival>& arrivals, const Window& window) {
  std::vector<std::int64_t> sequences;
  for (const PoseArrival& pose : arrivals) {
    if (pose.sequence >= window.first && pose.sequence <= window.last) sequences.push_back(pose.sequence);
  }
  std::ranges::sort(sequences);
  const auto rest = std::ranges::unique(sequences);
  return window.last - window.first + 1 - std::distance(sequences.begin(), rest.begin());
}

/// Wall-clock time of simulation time 0, as the fastest of all messages tells it.
Clock::time_point origin(const std::vector<std::vector<PoseArrival>>& all) {
  Clock::time_point first = Clock::time_point::max();
  for (const auto& arrivals : all) {
    for (const PoseArrival& pose : arrivals) first = std::min(first, pose.at - std::chrono::microseconds(pose.time_us));
  }
  return first;
}

/// The pointer goes round for so long: the doll never rests, and poses come at their full rate.
void stir(BusClient& client, std::array<double, 3> place, double seconds) {
  const Clock::time_point end =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  const double x = place[0];
  const double z = place[2];
  for (double angle = 0.0; Clock::now() < end; angle += 0.2) {
    place[0] = x + kStroke * std::sin(angle);
    place[2] = z + kStroke * std::cos(angle);
    client.point(place);
    std::this_thread::sleep_for(milliseconds(16));
  }
}

/// What the subscribers that keep up get beside one that has stopped and one that is slow.
void tell_subscribers(const LatencyOptions& options, std::vector<Figure>& figures) {
  const ServerProcess server(options.server,
                             {options.character, "--broker", "0", "--pose-hz", std::to_string(kPoseHz)});
  const StoppedSubscriber stopped(server.url());
  BusClient slow(server.url(), milliseconds(20));
  std::vector<std::unique_ptr<BusClient>> clients;
  for (int k = 0; k < kSubscribers - 2; ++k) clients.push_back(std::make_unique<BusClient>(server.url()));
  BusClient& hand = *clients.front();
  const std::array<double, 3> place = hand.grab();
  constexpr double kSettling = 0.5;  // [s]
  stir(hand, place, kSettling);
  const Window begin{hand.arrivals().back().sequence, 0};
  stir(hand, place, effort_of(options).seconds);
  const Window window{begin.first, hand.arrivals().back().sequence};
  std::this_thread::sleep_for(milliseconds(200));  // what is on its way comes
  std::vector<std::vector<PoseArrival>> all;
  for (const auto& client : clients) all.push_back(client->arrivals());
  const Clock::time_point start = origin(all);
  const auto poses = static_cast<double>(window.last - window.first + 1);
  double worst = 0.0;
  std::vector<double> ages;
  for (const auto& arrivals : all) {
    worst = std::max(worst, static_cast<double>(missing(arrivals, window)) / poses);
    for (const PoseArrival& pose : arrivals) {
      if (pose.sequence < window.first || pose.sequence > window.last) continue;
      ages.push_back(milliseconds_of(pose.at - start - std::chrono::microseconds(pose.time_us)));
    }
  }
  const std::string name = "10 subscribers, one stopped, one slow";
  figures.push_back({name + ": poses a second", poses / effort_of(options).seconds, ""});
  figures.push_back({name + ": share missing at the others", worst, "", 0.001});
  figures.push_back({name + ": age of a pose, p99", percentile(ages, 0.99), "ms", 5.0});
  figures.push_back({name + ": age of a pose, max", percentile(ages, 1.0), "ms"});
}

}  // namespace

void latency(const LatencyOptions& options) {
  std::vector<Figure> figures;
  const bool own_network = enter_own_network();
  tell_latency(options, "broker", {"--broker", "0"}, figures);
  if (own_network) {
    tell_latency(options, "multicast", {"--lcm-url", kMulticast}, figures);
  } else {
    std::fprintf(stderr, "layfigure-bench: no multicast: this machine does not allow network namespaces\n");
  }
  tell_subscribers(options, figures);
  print(figures, options.json);
}

}  // namespace layfigure::bench
