# Compiler settings shared by every target, and layfigure_library(), which makes one server folder a library.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

add_library(layfigure_flags INTERFACE)
add_library(layfigure::flags ALIAS layfigure_flags)
# No fused multiply-adds: a state must have the same bits on every machine that one toolchain builds for.
target_compile_options(layfigure_flags INTERFACE -Wall -Wextra -Wconversion -Wno-sign-conversion -Wshadow
                                                 -Wno-psabi -ffp-contract=off -fno-math-errno -fno-trapping-math)

# layfigure_known_options(TARGET SCOPE flag...)
# adds those flags that the compiler knows.
include(CheckCXXCompilerFlag)
function(layfigure_known_options target scope)
  foreach(flag ${ARGN})
    string(MAKE_C_IDENTIFIER "LAYFIGURE_KNOWS${flag}" known)
    check_cxx_compiler_flag(${flag} ${known})
    if(${known})
      target_compile_options(${target} ${scope} ${flag})
    endif()
  endforeach()
endfunction()

# Structs of packs (math/lanes.h) are copied pack by pack: a pack that was written in smaller pieces and is then read
# whole waits until the pieces have left the processor's store buffer, and so do packs that are read two at a time.
layfigure_known_options(layfigure_flags INTERFACE -mmove-max=256 -mstore-max=256 -mprefer-vector-width=256)

# layfigure_library(NAME SOURCES file... USES target... [PRIVATE_USES target...])
# makes the static library layfigure_NAME, alias layfigure::NAME, that exports ./include alone.
function(layfigure_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;USES;PRIVATE_USES")
  add_library(layfigure_${name} STATIC ${arg_SOURCES})
  add_library(layfigure::${name} ALIAS layfigure_${name})
  target_include_directories(layfigure_${name} PUBLIC ${CMAKE_CURRENT_SOURCE_DIR}/include)
  target_link_libraries(layfigure_${name} PUBLIC ${arg_USES} PRIVATE layfigure::flags ${arg_PRIVATE_USES})
endfunction()
