#pragma once

#include <random>
#include <string>

namespace layfigure::fuzz {

/// Spoils a file as disks, transfers, hand edits and ill will do: cuts it, flips bits, overwrites, repeats, moves or
/// removes blocks, and puts extreme numbers in place of binary or written ones. One to four of these, by `random`.
void mutate(std::string& bytes, std::mt19937_64& random);

}  // namespace layfigure::fuzz
