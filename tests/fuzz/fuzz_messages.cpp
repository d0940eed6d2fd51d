// Throws random and spoilt messages at the server's decoders and commands, and checks that none crashes or stalls it,
// that every command is answered, that a refused one changes nothing, and that memory stays what it was.
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <fstream>
#include <iostream>

#include "layfigure/messaging/codec.h"
#include "message_target.h"
#include "random_messages.h"
#include "tcpq.h"

namespace {

using namespace layfigure;
using Clock = std::chrono::steady_clock;

constexpr unsigned kHangSeconds = 60;  // for a batch: one takes milliseconds
constexpr std::uint64_t kBatch = 1000;
constexpr std::uint64_t kBatchesPerDoll = 200;  // then a new one: the commands would in the end have it in knots
constexpr double kMaxGrowthMb = 24.0;  // of the resident memory after the first fifth: caches and the heap's spread

double resident_mb() {
  std::ifstream file("/proc/self/statm");
  double total = 0.0;
  double resident = 0.0;
  file >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

messaging::ByteView view(const std::string& bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

/// A client's byte stream with the message in it, spoilt now and then, through the broker's parser.
void parse_stream(const std::string& bytes, std::mt19937_64& random) {
  using messaging::tcpq::Parser;
  std::string stream("\x28\x76\x17\xfb\0\0\1\0", 8);
  messaging::tcpq::Publish publish{"LAYFIGURE_COMMAND", {bytes.begin(), bytes.end()}};
  const messaging::Bytes frame = messaging::tcpq::frame(publish);
  stream.append(frame.begin(), frame.end());
  if (random() % 2 == 0) stream[random() % stream.size()] = static_cast<char>(random());
  Parser parser;
  for (std::size_t at = 0; at < stream.size();) {
    const std::size_t size = std::min<std::size_t>(1 + random() % 64, stream.size() - at);
    parser.feed(view(stream).subspan(at, size));
    at += size;
    while (parser.next()) {
    }
  }
}

/// One message through all that reads it. Empty, or what is wrong.
std::string try_message(fuzz::RandomMessages& messages, fuzz::MessageTarget& target) {
  const std::string bytes = messages.bytes();
  std::string wrong = target.receive_command(view(bytes));
  if (wrong.empty()) wrong = target.receive_pointer(view(bytes));
  (void)messaging::decode_spidar_state(view(bytes));
  (void)messaging::decode_heartbeat(view(bytes));
  if (messages.random()() % 16 == 0) parse_stream(bytes, messages.random());
  return wrong;
}

void add(fuzz::MessageTally& sum, const fuzz::MessageTally& part) {
  sum.accepted += part.accepted;
  sum.refused += part.refused;
  sum.pointers += part.pointers;
  sum.bad += part.bad;
}

/// One doll's share of the messages. Throws std::runtime_error with what was wrong, and where.
void run_batches(std::uint64_t seed, std::uint64_t count, fuzz::MessageTally& tally) {
  fuzz::RandomMessages messages(seed);
  fuzz::MessageTarget target;
  for (std::uint64_t k = 0; k < count; ++k) {
    if (k % kBatch == 0) alarm(kHangSeconds);
    const std::string wrong = try_message(messages, target);
    if (!wrong.empty()) {
      throw std::runtime_error("seed " + std::to_string(seed) + ", message " + std::to_string(k) + ": " + wrong);
    }
  }
  add(tally, target.tally());
}

void run(std::uint64_t seed, std::uint64_t count) {
  const Clock::time_point start = Clock::now();
  constexpr std::uint64_t kShare = kBatch * kBatchesPerDoll;
  fuzz::MessageTally tally;
  double settled_mb = 0.0;
  for (std::uint64_t done = 0; done < count; done += kShare) {
    if (5 * done <= count) settled_mb = resident_mb();
    run_batches(seed + done / kShare, std::min(kShare, count - done), tally);
  }
  if (count <= kShare) settled_mb = resident_mb();
  const double growth_mb = resident_mb() - settled_mb;
  std::cout << "seed " << seed << ": " << count << " messages, " << tally.accepted << " commands accepted, "
            << tally.refused << " refused, " << tally.pointers << " pointers, " << tally.bad << " times no message, "
            << std::chrono::duration<double>(Clock::now() - start).count() << " s, memory " << settled_mb << " MB "
            << std::showpos << growth_mb << " MB\n";
  if (growth_mb > kMaxGrowthMb) throw std::runtime_error("memory has grown by " + std::to_string(growth_mb) + " MB");
  if (tally.accepted == 0 || tally.refused == 0 || tally.pointers == 0) {
    throw std::runtime_error("the messages tried too little");
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Throws random and spoilt messages at the server's decoders and commands.");
  std::uint64_t seed = 1;
  std::uint64_t count = 100'000;
  app.add_option("--seed", seed, "of the messages [1]");
  app.add_option("--messages", count, "how many [100000]");
  CLI11_PARSE(app, argc, argv);
  spdlog::set_level(spdlog::level::off);  // each refusal would be told
  try {
    run(seed, count);
  } catch (const std::exception& error) {
    std::cerr << "fuzz_messages: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
