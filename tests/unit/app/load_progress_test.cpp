#include "layfigure/app/load_progress.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <unistd.h>

#include <array>
#include <optional>
#include <string>

namespace layfigure::app {
namespace {

using namespace std::chrono_literals;

/// What has been written so far; waits for it if `wanted` has not come yet.
std::string read_until(int file, const std::string& wanted) {
  constexpr int kPatience = 30'000;  // [ms], for a machine under load
  std::string text;
  while (text.find(wanted) == std::string::npos) {
    pollfd ready{file, POLLIN, 0};
    if (::poll(&ready, 1, kPatience) <= 0) break;
    std::array<char, 256> block{};
    const ssize_t count = ::read(file, block.data(), block.size());
    if (count <= 0) break;
    text.append(block.data(), static_cast<std::size_t>(count));
  }
  return text;
}

TEST(LoadProgress, Terminal_ShowsTheStageAndWipesItInTheEnd) {
  int screen = -1;
  int terminal = -1;
  ASSERT_EQ(::openpty(&screen, &terminal, nullptr, nullptr, nullptr), 0);
  {
    LoadProgress progress(terminal, 1ms);
    progress.stage("reading doll.glb");
    EXPECT_NE(read_until(screen, "reading doll.glb, 0 s").find("reading doll.glb, 0 s"), std::string::npos);
    progress.stage("making the doll");
    EXPECT_NE(read_until(screen, "making the doll").find("making the doll"), std::string::npos);
  }
  ASSERT_EQ(::write(terminal, "end", 3), 3);
  const std::string last = read_until(screen, "end");
  ASSERT_GE(last.size(), 7U);
  EXPECT_EQ(last.substr(last.size() - 7), "\r\033[Kend");
  EXPECT_EQ(last.find('\n'), std::string::npos);
  ::close(terminal);
  ::close(screen);
}

TEST(LoadProgress, QuickLoad_WritesNothing) {
  int screen = -1;
  int terminal = -1;
  ASSERT_EQ(::openpty(&screen, &terminal, nullptr, nullptr, nullptr), 0);
  { LoadProgress(terminal, 1h).stage("reading doll.glb"); }
  ASSERT_EQ(::write(terminal, "end", 3), 3);
  EXPECT_EQ(read_until(screen, "end"), "end");
  ::close(terminal);
  ::close(screen);
}

TEST(LoadProgress, Pipe_GetsNothing) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe(ends.data()), 0);
  {
    LoadProgress progress(ends[1], 1ms);
    progress.stage("reading doll.glb");
    ::usleep(20'000);
  }
  ::close(ends[1]);
  EXPECT_EQ(read_until(ends[0], "anything"), "");
  ::close(ends[0]);
}

}  // namespace
}  // namespace layfigure::app
