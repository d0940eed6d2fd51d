// Benchmarks of the simulation, one subject each. Timings are CPU time of the stepping thread.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "layfigure/dynamics/step.h"
#include "subjects.h"

namespace {
constexpr const char* kJsonHelp = "print a JSON list instead of a table";
}

int main(int argc, char** argv) {
  using namespace layfigure;
  CLI::App app{"Benchmarks of Layfigure's simulation."};
  app.footer(
      "Examples:\n"
      "  layfigure-bench work-precision --scene doll-52.json --order 4 --h 0.0333,0.01,0.004 --json\n"
      "  layfigure-bench cost\n"
      "  layfigure-bench contact --rows 60");
  app.require_subcommand(1);

  bench::WorkPrecisionOptions precision;
  auto* work = app.add_subcommand("work-precision", "CPU time and end state of a scene, for each step length");
  // Newer CLI11 takes -h and --h for the same name.
  work->set_help_flag("--help", "Print this help message and exit");
  work->add_option("--scene", precision.scene, "scene file (JSON)")->required();
  work->add_option("--order", precision.order, "convergence order")
      ->check(CLI::Range(1, dynamics::kMaxOrder))
      ->capture_default_str();
  work->add_option("--h", precision.h, "step lengths [s], separated by commas")
      ->delimiter(',')
      ->required()
      ->check(CLI::Range(1e-9, 10.0));
  work->add_flag("--json", precision.json, kJsonHelp);
  work->callback([&] { bench::work_precision(precision); });

  bench::CostOptions price{.scene = LAYFIGURE_TEST_DATA "/scenes/doll-52.json"};
  auto* cost = app.add_subcommand("cost", "CPU time of a step of each order");
  cost->add_option("--scene", price.scene, "scene file (JSON)")->capture_default_str();
  cost->add_flag("--json", price.json, kJsonHelp);
  cost->callback([&] { bench::cost(price); });

  bench::ContactOptions touch;
  auto* contact = app.add_subcommand("contact", "size of a contact problem against time, and a step with contacts");
  contact->add_option("--rows", touch.most_rows, "ends before the first larger problem")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str();
  contact->add_flag("--json", touch.json, kJsonHelp);
  contact->callback([&] { bench::contact(touch); });

  bench::SkipOptions saving;
  auto* skip = app.add_subcommand("skip", "what is saved by computing nothing that a scene does not need");
  skip->add_flag("--json", saving.json, kJsonHelp);
  skip->callback([&] { bench::skip(saving); });

  bench::HapticsOptions feel;
  auto* haptics = app.add_subcommand("haptics", "what the haptics are held to, with the simulated device");
  haptics->add_flag("--quick", feel.quick, "smaller counts: seconds instead of many minutes");
  haptics->add_option("--part", feel.parts, "only this, or these, separated by commas")
      ->delimiter(',')
      ->check(CLI::IsMember(bench::haptics_parts()));
  haptics->add_option("--z-width", feel.z_width, "write the stiffness and damping of stable walls to this file (JSON)");
  haptics->add_flag("--json", feel.json, kJsonHelp);
  haptics->callback([&] { bench::haptics(feel); });

  bench::LatencyOptions delay;
  auto* latency = app.add_subcommand("latency", "from a pointer's message to the pose, through a server of its own");
  latency->add_option("--server", delay.server, "layfigure-server")->required()->check(CLI::ExistingFile);
  latency->add_option("--character", delay.character, "of 60 joints")->required()->check(CLI::ExistingFile);
  latency->add_flag("--quick", delay.quick, "fewer messages: seconds instead of minutes");
  latency->add_flag("--json", delay.json, kJsonHelp);
  latency->callback([&] { bench::latency(delay); });

  bench::StressOptions ordeal;
  auto* stress = app.add_subcommand("stress", "random scenes: time, and how many steps needed help");
  stress->add_option("--scenes", ordeal.scenes, "how many")->check(CLI::Range(1, 1'000'000'000))->capture_default_str();
  stress->add_flag("--json", ordeal.json, kJsonHelp);
  stress->callback([&] { bench::stress(ordeal); });

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "layfigure-bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
