#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "layfigure/app/server.h"

namespace layfigure::app {

/// Exit codes of the program.
inline constexpr int kExitDone = 0;
inline constexpr int kExitFailed = 1;
inline constexpr int kExitUsage = 2;

/// The command line.
struct Options {
  std::filesystem::path character;
  std::optional<std::filesystem::path> doll_settings;
  bool inspect{false};
  bool json{false};                                     ///< of inspect
  bool geometry{false};                                 ///< of json
  std::optional<std::filesystem::path> write_settings;  ///< of inspect: where to
  bool force{false};                                    ///< of write_settings: also over a file that is there
  std::optional<std::filesystem::path> replay;          ///< the log to play again
  bool ends_with_input{false};                          ///< leaves when standard input ends
  ServerSettings server;
};

/// "layfigure-server 0.1.0"
[[nodiscard]] std::string program_version();

/// What is to be done, or with which code to exit at once.
struct ParsedOptions {
  std::optional<Options> options;
  int exit_code{kExitDone};
};

/// Reads the command line. Prints help or the version on stdout, or one line on stderr that says which option is wrong
/// and what it may be.
[[nodiscard]] ParsedOptions parse_options(int argc, const char* const* argv);

}  // namespace layfigure::app
