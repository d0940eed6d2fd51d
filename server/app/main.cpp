#include <spdlog/spdlog.h>

#include <exception>
#include <iostream>

#include "layfigure/app/inspect_doll.h"
#include "layfigure/app/load_doll.h"
#include "layfigure/app/options.h"
#include "layfigure/app/replay.h"
#include "layfigure/app/server.h"
#include "layfigure/app/stderr_log.h"
#include "layfigure/app/stop_signals.h"

namespace {

using namespace layfigure;

/// Returns the exit code.
int replay(const app::Options& options) {
  app::Replay replay(*options.replay);
  const std::filesystem::path character =
      options.character.empty() ? std::filesystem::path(replay.start().character) : options.character;
  const app::ReplayReport report = replay.run(app::load_doll(character, replay.doll_settings()));
  if (report.difference.empty()) {
    std::cout << "replayed " << report.steps << " steps: all " << report.poses << " poses are the same, bit for bit\n";
    return app::kExitDone;
  }
  spdlog::error("the replay differs from the log after {} poses: {}", report.poses, report.difference);
  return app::kExitFailed;
}

void run(const app::Options& options) {
  doll::Doll doll = app::load_doll(options);
  if (options.inspect) {
    app::inspect_doll(doll, options, std::cout);
    return;
  }
  const std::size_t remarks = doll.warnings.size();
  const app::StopSignals signals(options.ends_with_input);
  app::Server server(std::move(doll), options.server);
  const std::jthread watch = signals.watch([&] { server.stop(); });
  if (remarks > 0) spdlog::warn("remarks on the character: {}; --inspect lists them", remarks);
  std::cout << "listening on " << server.url() << std::endl;
  server.run();
}

}  // namespace

int main(int argc, char** argv) {
  app::log_to_stderr("layfigure-server");
  const app::ParsedOptions parsed = app::parse_options(argc, argv);
  if (!parsed.options) return parsed.exit_code;
  try {
    if (parsed.options->replay) return replay(*parsed.options);
    run(*parsed.options);
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return app::kExitFailed;
  }
  return app::kExitDone;
}
