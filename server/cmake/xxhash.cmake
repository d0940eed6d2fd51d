# Debian's xxHash comes without a CMake config: its header, which holds the whole library, as one target,
# layfigure::xxhash.
find_path(XXHASH_INCLUDE_DIR xxhash.h REQUIRED)
add_library(layfigure_xxhash INTERFACE)
add_library(layfigure::xxhash ALIAS layfigure_xxhash)
target_include_directories(layfigure_xxhash SYSTEM INTERFACE ${XXHASH_INCLUDE_DIR})
target_compile_definitions(layfigure_xxhash INTERFACE XXH_INLINE_ALL)
