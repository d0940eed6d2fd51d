#include <string>
#include <vector>

#include "bullet_mlcp.h"
#include "contact_problem.h"
#include "cpu_time.h"
#include "figures.h"
#include "subjects.h"

namespace layfigure::bench {
namespace {

using dynamics::LcpReport;
using dynamics::LcpWorkspace;

constexpr double kStep = 2e-3;

struct Answer {
  LcpReport report;
  Eigen::VectorXd impulses;
};

Answer solve(const ContactProblem& problem, const Eigen::VectorXd& start, LcpWorkspace& workspace) {
  Answer answer{.report = {}, .impulses = start};
  answer.report = solve_lcp(problem.delassus, problem.bias, problem.rows, answer.impulses, workspace);
  return answer;
}

void tell_solution(const std::string& name, const ContactProblem& problem, const Eigen::VectorXd& start,
                   std::vector<Figure>& figures) {
  LcpWorkspace workspace;
  workspace.reserve(problem.size());
  Answer answer = solve(problem, start, workspace);
  const double seconds = cpu_seconds_of([&] {
    answer.impulses = start;
    answer.report = solve_lcp(problem.delassus, problem.bias, problem.rows, answer.impulses, workspace);
  });
  figures.push_back({name, seconds * 1e6, "us"});
  figures.push_back({name + ": iterations", static_cast<double>(answer.report.iterations), ""});
  figures.push_back({name + ": residual", answer.report.residual, "", dynamics::kLcpTolerance});
}

/// Two steps in succession: the second one's problem is solved from nothing and from what the first one's left.
void tell_friction(const std::string& name, const ContactProblem& last, const ContactProblem& next,
                   std::vector<Figure>& figures) {
  LcpWorkspace workspace;
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(last.size());
  const Eigen::VectorXd impulses = solve(last, zero, workspace).impulses;
  tell_solution(name + ", cold", next, Eigen::VectorXd::Zero(next.size()), figures);
  tell_solution(name + ", warm", next, warm_start(last, impulses, next), figures);
}

void tell_frictionless(const std::string& name, const ContactProblem& problem, std::vector<Figure>& figures) {
  tell_solution(name + ", Layfigure", problem, Eigen::VectorXd::Zero(problem.size()), figures);
  for (const BulletMlcp solver : kBulletMlcps) {
    const BulletAnswer answer = solve_by_bullet(solver, problem);
    const std::string who = name + ", " + name_of(solver);
    figures.push_back({who, answer.cpu_seconds * 1e6, "us"});
    figures.push_back({who + (answer.claimed ? ": residual" : ": residual, having given up"),
                       unilateral_residual(problem, answer.impulses), ""});
  }
}

/// A step of a scene that goes on from `start`. Its first steps are not counted: the contact points that a new scene
/// chooses need not be those whose impulses the state remembers.
double step_seconds(const scene::SceneDefinition& definition, const dynamics::State& start) {
  constexpr int kUncounted = 10;
  scene::Scene scene(definition);
  dynamics::State state = start;
  const auto step = [&] { (void)scene.step(state, {}, {.step = kStep}); };
  for (int k = 0; k < kUncounted; ++k) step();
  const dynamics::State settled = state;
  return cpu_seconds_of([&] {
    state = settled;
    step();
  });
}

void tell_step(const RestingScene& resting, std::size_t contacts, std::vector<Figure>& figures) {
  scene::SceneDefinition bare = resting.definition;
  bare.shapes.clear();
  const double with = step_seconds(resting.definition, resting.state);
  const double without = step_seconds(bare, resting.state);
  const std::string name = resting.name + ", base step";
  figures.push_back(
      {name + " with " + std::to_string(contacts) + (contacts == 1 ? " contact" : " contacts"), with * 1e6, "us"});
  figures.push_back({name + " without contacts", without * 1e6, "us"});
  figures.push_back({name + ": with contacts / without", with / without, ""});
}

std::string title(const std::string& scene, const std::string& kind, const ContactProblem& problem) {
  return scene + ", " + kind + ", " + std::to_string(problem.size()) + (problem.size() == 1 ? " row" : " rows");
}

}  // namespace

void contact(const ContactOptions& options) {
  std::vector<Figure> figures;
  for (const FallingScene& falling : falling_scenes()) {
    const RestingScene resting = settled(falling);
    const std::vector<ContactProblem> problems = contact_problems(resting, 2);
    const ContactProblem& problem = problems.back();
    if (problem.size() > options.most_rows) break;
    tell_friction(title(resting.name, "friction", problem), problems.front(), problem, figures);
    const ContactProblem smooth = frictionless(problem);
    tell_frictionless(title(resting.name, "frictionless", smooth), smooth, figures);
    tell_step(resting, problem.keys.size(), figures);
  }
  print(figures, options.json);
}

}  // namespace layfigure::bench
