#pragma once

#include <iosfwd>

#include "layfigure/app/options.h"
#include "layfigure/doll/doll.h"

namespace layfigure::app {

/// What --inspect does: writes settings if that is asked for, and describes the doll. Throws doll::SettingsError:
/// settings that cannot be written; nothing is put out then.
void inspect_doll(const doll::Doll& doll, const Options& options, std::ostream& out);

}  // namespace layfigure::app
