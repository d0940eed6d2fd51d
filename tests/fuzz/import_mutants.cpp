// Imports mutants of the given files and makes dolls of those that can be read. Whatever a mutant does to its reader,
// the answer must be a rig or one line; the first that gets another is kept, and its name printed.
#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "layfigure/character/import.h"
#include "layfigure/doll/build.h"
#include "mutate.h"

namespace {

using namespace layfigure;
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kLongestAnswer = 2000;  // [bytes], of a message with its path

struct Tally {
  std::size_t mutants{0};
  std::size_t dolls{0};
  std::size_t refused{0};
  std::size_t crashed{0};  ///< readers that did, in their own process
  std::size_t stopped{0};  ///< at a limit of time or memory
  double longest{0.0};     ///< [s]
};

std::string read_file(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path.string() + " cannot be read: install Debian's assimp-testmodels");
  return {std::istreambuf_iterator<char>(file), {}};
}

/// What is wrong with the answer to the file; "" if nothing is.
std::string judge(const fs::path& file, Tally& tally) {
  std::string answer;
  try {
    (void)doll::build_doll(character::import_rig(file));
    ++tally.dolls;
    return {};
  } catch (const character::ImportError& error) {
    answer = error.what();
  } catch (const std::invalid_argument& error) {  // of build_doll: no bone has enough skin
    answer = file.string() + ": " + error.what();
  } catch (const std::exception& error) {
    return std::string("an exception of another kind: ") + error.what();
  }
  ++tally.refused;
  if (answer.find("crashes its reader") != std::string::npos) ++tally.crashed;
  if (answer.find("was stopped") != std::string::npos || answer.find("memory") != std::string::npos) ++tally.stopped;
  if (answer.find(file.string()) == std::string::npos) return "an answer that does not name the file: " + answer;
  if (answer.find('\n') != std::string::npos) return "an answer of several lines: " + answer;
  if (answer.size() > kLongestAnswer) return "an answer of " + std::to_string(answer.size()) + " bytes";
  return {};
}

/// A folder of this run, removed at the end.
struct Folder {
  fs::path path{fs::temp_directory_path() / ("layfigure-mutants-" + std::to_string(std::random_device()()))};
  Folder() { fs::create_directories(path); }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
};

/// One mutant of one file. False, and the mutant kept in the working folder, if its answer is wrong.
bool try_mutant(const fs::path& source, std::string bytes, std::mt19937_64& random, const Folder& folder,
                Tally& tally) {
  fuzz::mutate(bytes, random);
  const fs::path file = folder.path / ("mutant" + source.extension().string());
  std::ofstream(file, std::ios::binary) << bytes;
  const auto start = Clock::now();
  const std::string wrong = judge(file, tally);
  ++tally.mutants;
  tally.longest = std::max(tally.longest, std::chrono::duration<double>(Clock::now() - start).count());
  if (wrong.empty()) return true;
  const fs::path kept = "mutant-" + std::to_string(tally.mutants) + source.extension().string();
  fs::copy_file(file, kept, fs::copy_options::overwrite_existing);
  std::cerr << "import_mutants: " << fs::absolute(kept) << " of " << source << ": " << wrong << '\n';
  return false;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Imports mutants of rigged files and checks that each is read or refused with one line.");
  std::vector<fs::path> sources;
  std::uint64_t seed = 1;
  std::size_t mutants = 100;
  double seconds = 0.0;
  app.add_option("FILE", sources, "rigged files")->required();
  app.add_option("--seed", seed, "of the mutations [1]");
  app.add_option("--mutants", mutants, "of each file [100]");
  app.add_option("--seconds", seconds, "goes on for so long instead");
  CLI11_PARSE(app, argc, argv);
  try {
    std::vector<std::string> contents;
    for (const fs::path& source : sources) contents.push_back(read_file(source));
    const Folder folder;
    std::mt19937_64 random(seed);
    Tally tally;
    const auto start = Clock::now();
    const auto goes_on = [&](std::size_t round) {
      return seconds > 0.0 ? Clock::now() - start < std::chrono::duration<double>(seconds) : round < mutants;
    };
    bool all_right = true;
    for (std::size_t round = 0; all_right && goes_on(round); ++round) {
      for (std::size_t k = 0; all_right && k < sources.size(); ++k) {
        all_right = try_mutant(sources[k], contents[k], random, folder, tally);
      }
    }
    std::cout << "seed " << seed << ": " << tally.mutants << " mutants, " << tally.dolls << " dolls, " << tally.refused
              << " refused (" << tally.crashed << " crashed their reader, " << tally.stopped
              << " were stopped at a limit), longest " << tally.longest << " s\n";
    return all_right ? 0 : 1;
  } catch (const std::exception& error) {
    std::cerr << "import_mutants: " << error.what() << '\n';
    return 1;
  }
}
