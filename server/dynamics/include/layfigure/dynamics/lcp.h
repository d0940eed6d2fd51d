#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <span>

/// The dense mixed complementarity problem of a step's constraint rows, with friction as a true second-order cone.
///
/// Find impulses lambda [N s, or N m s] and velocities v = A lambda + b [m/s, rad/s], A symmetric positive semidefinite
/// (a Delassus matrix plus compliance; singular where rows are redundant), such that row by row
///     equality    v = 0
///     unilateral  0 <= lambda  perp  v >= 0
///     box         lo <= lambda <= hi;   v >= 0 at lo,  v <= 0 at hi,  v = 0 between
///     contact     rows n, t1, t2 with the friction coefficient mu (Coulomb's law, isotropic):
///                 0 <= lambda_n  perp  v_n >= 0,   |lambda_t| <= mu lambda_n,
///                 lambda_t = -mu lambda_n v_t / |v_t| where v_t != 0
///
/// Theory. Each law is an equation between lambda and z = lambda - v (Alart & Curnier 1991 for contacts):
///     lambda = clamp(z, lo, hi);     contact: lambda_n = max(0, z_n), lambda_t = z_t shortened to mu lambda_n      (1)
/// Rows are first scaled by d = A_ii^-1/2 (one d per contact, so that its cone stays a cone): lambda / d and d v have
/// the same unit, and every tolerance below is relative to m, the largest component of d b and of P_K(0) / d.
///  1. Without contacts: Newton's method on (1), semismooth, from the given lambda; a step is shortened where the
///     residual would not fall. A step solves one system of the size of the active set, symmetric unless a contact
///     slides. It is a primal-dual active-set method: one step is exact once the active set is right.
///  2. With contacts: such steps while each halves the residual, as near a solution they do; then rounds of the
///     proximal-point method on the law itself, (1) for the velocities
///         v + e (lambda - lambda[k])                                                                             (2)
///     by the same method. Where redundant contacts contradict each other a little, such as those of a capsule that
///     lies on a plane, the systems of 1 have no solution and its steps no bound; those of (2) have, to first order,
///     and the pull e (lambda - lambda[k]) vanishes as the rounds converge: e follows the residual r of lambda[k], so
///     near a solution convergence is faster than linear. e rises after a round that was not solved. Steps are taken
///     whole, for a set may have to change through worse ones; rounds that cycle take turns with steps of (2) about
///     the step's own beginning, whose pull is the stronger the less a contact carries.
///  3. Where that stalls, rounds of the proximal-point method on the convex problem that friction with a fixed offset s
///     on the normal rows is; K is the product of the rows' sets (reals, half-line, interval, cone), e > 0:
///         lambda[k+1] = argmin over K of  lambda^T A lambda / 2 + (b + s)^T lambda + e |lambda - lambda[k]|^2 / 2 (3)
///     With s = mu |v_t| its limit is Coulomb's law (De Saxce & Feng 1998), so s is taken anew after each round, after
///     some block Gauss-Seidel sweeps; and the method of 1 is tried again. (3) is solved by Newton's method with a line
///     search on its dual, y^T A y / 2 + psi(A y + b): convex, once continuously differentiable, and coercive modulo
///     the null space of A. With contacts the rounds end where they no longer reduce the residual.
///
/// Guarantee. (3) always has exactly one solution, to which its Newton iteration converges from anywhere. Without
/// contacts s is zero, the whole problem is convex, and the rounds converge to a solution whenever there is one,
/// redundant or not. Coulomb's law is not convex: solutions may be several or none, no method is known that always
/// finds one, and neither the fixed point in s nor the steps and rounds of 1 and 2 are then guaranteed to converge.
/// Every loop is bounded, so a call always ends, with a lambda in K.
///
/// Fallback. What is not solved is reported as such, and lambda is then
///   - infeasible: the solution of (3) about P_K(0) with e = 1e-6, that is, with every row a little compliant: for rows
///     that contradict each other nearly the least-squares velocity. |lambda / d| <= 1e6 |d (b + s)| if K contains 0.
///     Infeasible means that a ray r in K was found with A r = 0, to rounding, and (b + s)^T r < 0, such that every
///     solution would have a scaled size above 1e7 m (Farkas' lemma; a proof without contacts, with them for this s).
///   - iteration limit: the iterate of least residual that was met, of a scaled size below 1e7 m.
namespace layfigure::dynamics {

/// What a row demands. A contact takes three consecutive rows: kContact (its normal), kTangent, kTangent.
enum class LcpRowKind { kBox, kContact, kTangent };

/// The law of one row.
struct LcpRow {
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  LcpRowKind kind{LcpRowKind::kBox};
  double lower{-kInfinity};  ///< kBox: lo [N s], not NaN, <= upper
  double upper{kInfinity};   ///< kBox: hi [N s]
  double friction{0.0};      ///< kContact: mu >= 0, finite

  [[nodiscard]] static constexpr LcpRow equality() { return {}; }
  [[nodiscard]] static constexpr LcpRow unilateral() { return {.lower = 0.0}; }
  [[nodiscard]] static constexpr LcpRow box(double lower, double upper) { return {.lower = lower, .upper = upper}; }
  [[nodiscard]] static constexpr LcpRow contact(double mu) { return {.kind = LcpRowKind::kContact, .friction = mu}; }
  [[nodiscard]] static constexpr LcpRow tangent() { return {.kind = LcpRowKind::kTangent}; }
};

enum class LcpStatus {
  kSolved,          ///< the residual is at most kLcpTolerance
  kInfeasible,      ///< the rows contradict each other: a compliant answer
  kIterationLimit,  ///< the best iterate
  kInvalid,         ///< NaN or infinity in A or b, rows that are no laws, or A so negative that no finite answer was
                    ///< found: lambda is zero
};

/// Relative complementarity residual at which a problem counts as solved.
constexpr double kLcpTolerance = 1e-10;

struct LcpReport {
  LcpStatus status{LcpStatus::kSolved};
  double residual{0.0};  ///< largest difference between the sides of (1), scaled, relative to m
  int worst_row{-1};     ///< the row of that component; -1: no rows
  int iterations{0};     ///< linear systems solved; 0: the given lambda was a solution
};

/// Scratch memory. One per thread.
class LcpWorkspace {
 public:
  LcpWorkspace();
  ~LcpWorkspace();
  LcpWorkspace(LcpWorkspace&&) noexcept;
  LcpWorkspace& operator=(LcpWorkspace&&) noexcept;

  /// Makes room for problems of up to `rows` rows: solving them allocates nothing. A larger problem grows it.
  void reserve(int rows);

  struct Data;
  [[nodiscard]] Data& data() { return *data_; }

 private:
  std::unique_ptr<Data> data_;
};

/// Solves the problem. `delassus` is n x n, its lower triangle is read; `bias` is b; `rows` and `lambda` have n
/// entries. `lambda` is the start on entry (the last step's impulses, zero for new rows; what is not finite or above
/// 1e7 d m counts as zero) and the answer, always in K, on return. Near a solution this warm start needs 0 to 5
/// iterations. Cost: O(a^3) per iteration, a the number of active rows, plus O(n^2). Throws nothing; allocates nothing
/// within the reserved size. Deterministic. Not thread-safe for one workspace.
[[nodiscard]] LcpReport solve_lcp(const Eigen::Ref<const Eigen::MatrixXd>& delassus,
                                  const Eigen::Ref<const Eigen::VectorXd>& bias, std::span<const LcpRow> rows,
                                  Eigen::Ref<Eigen::VectorXd> lambda, LcpWorkspace& workspace);

}  // namespace layfigure::dynamics
