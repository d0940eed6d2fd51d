#include "layfigure/app/inspect_doll.h"

#include <spdlog/spdlog.h>

#include <ostream>

#include "layfigure/doll/inspect.h"
#include "layfigure/doll/write_settings.h"

namespace layfigure::app {

void inspect_doll(const doll::Doll& doll, const Options& options, std::ostream& out) {
  if (options.write_settings) {
    doll::write_settings(doll, *options.write_settings, options.force);
    spdlog::info("settings written: {}", options.write_settings->string());
  }
  out << (options.json ? doll::inspect_json(doll, options.geometry) : doll::inspect_text(doll)) << std::flush;
}

}  // namespace layfigure::app
