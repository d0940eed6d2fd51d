#include "layfigure/messaging/event_log.h"

#include <fcntl.h>
#include <lcm/eventlog.h>
#include <spdlog/spdlog.h>
#include <sys/file.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <thread>
#include <utility>

#include "byte_ring.h"

namespace layfigure::messaging {
namespace {

constexpr std::chrono::milliseconds kFlushInterval{200};
constexpr std::size_t kRingBytes = 16U << 20;  // of a kilobyte in each of 20 000 steps/s, four flush intervals' worth

std::int64_t wall_clock_us() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}

/// What an event begins with where it waits; its channel and its bytes follow.
struct Head {
  std::int64_t time_us;
  std::uint32_t channel_size;
  std::uint32_t size;
};

Head head_of(std::string_view channel, ByteView bytes) {
  return {wall_clock_us(), static_cast<std::uint32_t>(channel.size()), static_cast<std::uint32_t>(bytes.size())};
}

template <class Value>
ByteView bytes_of(const Value* values, std::size_t count) {
  return {reinterpret_cast<const std::uint8_t*>(values), count * sizeof(Value)};
}

/// Open, and ours alone until it is closed.
int lock_file(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (file < 0) throw LogError("cannot write the log '" + path.string() + "': " + std::strerror(errno));
  if (::flock(file, LOCK_EX | LOCK_NB) == 0) return file;
  ::close(file);
  throw LogError("the log '" + path.string() + "' is being written by another process: choose another name");
}

}  // namespace

struct EventLogWriter::Impl {
  explicit Impl(const std::filesystem::path& name)
      : path(name), lock(lock_file(name)), log(lcm_eventlog_create(name.c_str(), "w")) {
    if (log == nullptr) {
      ::close(lock);
      throw LogError("cannot write the log '" + path.string() + "': " + std::strerror(errno));
    }
    thread = std::thread([this] { run(); });
  }

  void run();
  [[nodiscard]] bool put(const Bytes& events) const;
  void end(const std::string& why);

  const std::filesystem::path path;
  const int lock;
  lcm_eventlog_t* const log;
  std::atomic<bool> ended{false};
  ByteRing ring{kRingBytes};  ///< newer than the queue; taken under the mutex
  std::mutex mutex;
  std::condition_variable changed;
  Bytes queue;
  bool closing{false};
  std::thread thread;  // last: it uses the others
};

/// False if the file takes no more.
bool EventLogWriter::Impl::put(const Bytes& events) const {
  std::size_t at = 0;
  while (at < events.size()) {
    Head head{};
    std::memcpy(&head, &events[at], sizeof head);
    const auto* channel = reinterpret_cast<const char*>(&events[at]) + sizeof head;
    lcm_eventlog_event_t record{};
    record.timestamp = head.time_us;
    record.channellen = static_cast<std::int32_t>(head.channel_size);
    record.datalen = static_cast<std::int32_t>(head.size);
    record.channel = const_cast<char*>(channel);  // LCM's writer changes nothing
    record.data = const_cast<char*>(channel + head.channel_size);
    if (lcm_eventlog_write_event(log, &record) != 0) return false;
    at += sizeof head + head.channel_size + head.size;
  }
  return std::fflush(log->f) == 0;
}

void EventLogWriter::Impl::end(const std::string& why) {
  if (ended.exchange(true)) return;
  {
    const std::lock_guard guard(mutex);
    queue = {};
  }
  spdlog::error("the log '{}' ends here: {}", path.string(), why);
}

void EventLogWriter::Impl::run() {
  Bytes batch;
  for (bool last = false; !last;) {
    {
      std::unique_lock guard(mutex);
      changed.wait_for(guard, kFlushInterval, [&] { return closing; });
      last = closing;
      ring.take(queue);
      batch.swap(queue);
    }
    if (!ended && !batch.empty() && !put(batch)) end(std::strerror(errno));
    batch.clear();
    if (batch.capacity() > kRingBytes) batch.shrink_to_fit();  // a disk that stood still stands still seldom
  }
}

EventLogWriter::EventLogWriter(const std::filesystem::path& path) : impl_(std::make_unique<Impl>(path)) {}

EventLogWriter::~EventLogWriter() {
  {
    const std::lock_guard guard(impl_->mutex);
    impl_->closing = true;
  }
  impl_->changed.notify_one();
  impl_->thread.join();
  lcm_eventlog_destroy(impl_->log);
  ::close(impl_->lock);
}

void EventLogWriter::write(std::string_view channel, ByteView bytes) {
  if (impl_->ended) return;
  const Head head = head_of(channel, bytes);
  {
    const std::lock_guard guard(impl_->mutex);
    Bytes& queue = impl_->queue;
    impl_->ring.take(queue);
    if (queue.size() + sizeof head + channel.size() + bytes.size() <= kMostWaiting) {
      for (const ByteView piece : {bytes_of(&head, 1), bytes_of(channel.data(), channel.size()), bytes}) {
        queue.insert(queue.end(), piece.begin(), piece.end());
      }
      return;
    }
  }
  impl_->end("the disk is too slow for it");
}

void EventLogWriter::write_from_step(std::string_view channel, ByteView bytes) {
  if (impl_->ended) return;
  const Head head = head_of(channel, bytes);
  if (impl_->ring.put({bytes_of(&head, 1), bytes_of(channel.data(), channel.size()), bytes})) return;
  write(channel, bytes);
}

struct EventLogReader::Impl {
  lcm_eventlog_t* log;
};

EventLogReader::EventLogReader(const std::filesystem::path& path)
    : impl_(std::make_unique<Impl>(Impl{lcm_eventlog_create(path.c_str(), "r")})) {
  if (impl_->log == nullptr) throw LogError("cannot read the log '" + path.string() + "': " + std::strerror(errno));
}

EventLogReader::~EventLogReader() { lcm_eventlog_destroy(impl_->log); }

std::optional<LogEvent> EventLogReader::next() {
  lcm_eventlog_event_t* event = lcm_eventlog_read_next_event(impl_->log);
  if (event == nullptr) return std::nullopt;
  const auto* data = static_cast<const std::uint8_t*>(event->data);
  LogEvent result{std::string(event->channel, event->channellen), Bytes(data, data + event->datalen)};
  lcm_eventlog_free_event(event);
  return result;
}

}  // namespace layfigure::messaging
