// Stands in for libFuzzer where the compiler has none: gives a target random bytes, or mutants of files, by a seed.
#include <CLI/CLI.hpp>
#include <cstdint>
#include <fstream>
#include <iostream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "mutate.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

constexpr std::size_t kLongest = 4096;  // [bytes], as libFuzzer's own

std::string random_bytes(std::mt19937_64& random) {
  std::string bytes(random() % kLongest, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random());
  return bytes;
}

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Without files random bytes, else mutants of these.
void run(std::uint64_t seed, std::uint64_t inputs, const std::vector<std::string>& paths) {
  std::mt19937_64 random(seed);
  std::vector<std::string> seeds;
  for (const std::string& path : paths) seeds.push_back(content(path));
  for (std::uint64_t k = 0; k < inputs; ++k) {
    std::string bytes = seeds.empty() ? random_bytes(random) : seeds[k % seeds.size()];
    if (!seeds.empty()) layfigure::fuzz::mutate(bytes, random);
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Gives a fuzzer's target random bytes, or mutants of files. It aborts where the target finds a fault.");
  std::uint64_t seed = 1;
  std::uint64_t inputs = 1000;
  std::vector<std::string> paths;
  app.add_option("--seed", seed, "of the inputs [1]");
  app.add_option("--inputs", inputs, "how many [1000]");
  app.add_option("files", paths, "mutants of which are given")->check(CLI::ExistingFile);
  CLI11_PARSE(app, argc, argv);
  run(seed, inputs, paths);
  return 0;
}
