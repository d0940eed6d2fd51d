// A scene in Bullet's btMultiBody, told like `layfigure-bench work-precision --json`. Single precision, as Debian
// builds it; joint torques are explicit.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <iostream>

#include "bullet_world.h"
#include "precision_run.h"

namespace {

using namespace layfigure;

constexpr const char* kEngine = "Bullet btMultiBody";

using testing::BulletSolver;

bench::Outcome run(const testing::Scene& scene, int steps, BulletSolver solver) {
  const testing::BulletResult result = testing::run_bullet(scene, steps, solver);
  return {.coms = result.coms,
          .energy = result.energy,
          .finite = result.finite,
          .cpu_seconds = result.cpu_seconds,
          .touch = result.touch};
}

void print_json(const std::string& path, const std::vector<double>& lengths, BulletSolver solver) {
  const testing::Scene scene = testing::load_scene(path);
  auto list = nlohmann::ordered_json::array();
  for (const double h : lengths) {
    const auto row = bench::measure(scene, h, [&](int steps) { return run(scene, steps, solver); });
    nlohmann::ordered_json json{{"scene", scene.name}, {"engine", kEngine}};
    json.update(bench::json_of(scene, row));
    list.push_back(json);
  }
  std::cout << list.dump(1) << "\n";
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"CPU time and end state of a scene in Bullet's btMultiBody, as a JSON list with an entry for each h."};
  std::string scene;
  std::vector<double> lengths;
  bool dantzig = false;
  app.add_option("--scene", scene, "scene file (JSON)")->required();
  app.add_option("--h", lengths, "step lengths [s], separated by commas")
      ->delimiter(',')
      ->required()
      ->check(CLI::Range(1e-9, 10.0));
  app.add_flag("--dantzig", dantzig, "contacts by btMLCPSolver's Dantzig instead of sequential impulses");
  try {
    app.parse(argc, argv);
    print_json(scene, lengths, dantzig ? BulletSolver::kDantzig : BulletSolver::kSequentialImpulses);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bullet_peer: %s\n", error.what());
    return 1;
  }
  return 0;
}
