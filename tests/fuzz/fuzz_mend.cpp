// libFuzzer's target: bytes are mended as a file of each format that is. What was mended needs no mending again.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "source_mend.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using layfigure::character::mend_source;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  for (const char* ending : {".dae", ".gltf", ".glb"}) {
    const std::string mended = mend_source(bytes, ending);
    if (mend_source(mended, ending) != mended) std::abort();
  }
  return 0;
}
