#include "adapters/ipopt/ipopt.h"

#include <IpIpoptApplication.hpp>
#include <IpIpoptCalculatedQuantities.hpp>
#include <IpIpoptData.hpp>
#include <IpSolveStatistics.hpp>
#include <algorithm>
#include <cerrno>
#include <cstring>

#include "phs/error.h"
#include "planning/nonlinear_programme.h"

namespace porthos::adapters {
namespace {

using namespace planning;
using Ipopt::Index, Ipopt::Number, Ipopt::SmartPtr;

/// What IPOPT asks of a problem.
class Questions final : public Ipopt::TNLP {
 public:
  Questions(const Problem& problem, const Trajectory& guess, const PlannerOptions& o)
      : programme_(problem), o_(o), z_(guess.x) {
    z_.insert(z_.end(), guess.u.begin(), guess.u.end());
    std::copy(problem.start.begin(), problem.start.end(), z_.begin());
  }
  Plan plan;

  bool get_nlp_info(Index& n, Index& m, Index& of_jacobian, Index& of_hessian,
                    IndexStyleEnum& style) override {
    n = Index(programme_.unknowns().lower.size());
    m = Index(programme_.rows().lower.size());
    of_jacobian = Index(programme_.jacobian_pattern().row.size());
    of_hessian = Index(programme_.hessian_pattern().row.size());
    style = C_STYLE;
    return true;
  }
  bool get_bounds_info(Index, Number* low, Number* high, Index, Number* c_low,
                       Number* c_high) override {
    const auto copy = [](const NonlinearProgramme::Bounds& b, Number* lower, Number* upper) {
      std::copy(b.lower.begin(), b.lower.end(), lower);
      std::copy(b.upper.begin(), b.upper.end(), upper);
    };
    copy(programme_.unknowns(), low, high);
    copy(programme_.rows(), c_low, c_high);
    return true;
  }
  bool get_starting_point(Index, bool, Number* z, bool, Number*, Number*, Index, bool,
                          Number*) override {
    std::copy(z_.begin(), z_.end(), z);
    return true;
  }
  bool eval_f(Index n, const Number* z, bool, Number& cost) override {
    if (!go_to(n, z)) return false;
    cost = programme_.cost();
    return true;
  }
  bool eval_g(Index n, const Number* z, bool, Index m, Number* c) override {
    if (!go_to(n, z)) return false;
    programme_.values({c, size_t(m)});
    return true;
  }
  bool eval_grad_f(Index n, const Number* z, bool, Number* g) override {
    if (!go_to(n, z)) return false;
    programme_.gradient({g, size_t(n)});
    return true;
  }
  bool eval_jac_g(Index n, const Number* z, bool, Index, Index count, Index* row, Index* column,
                  Number* numbers) override {
    if (!numbers) return copy(programme_.jacobian_pattern(), row, column);
    if (!go_to(n, z)) return false;
    accepted_ = last_;
    programme_.jacobian({numbers, size_t(count)});
    return true;
  }
  bool eval_h(Index n, const Number* z, bool, Number factor, Index m, const Number* lambda, bool,
              Index count, Index* row, Index* column, Number* numbers) override {
    if (!numbers) return copy(programme_.hessian_pattern(), row, column);
    if (!go_to(n, z)) return false;
    programme_.hessian(factor, {lambda, size_t(m)}, {numbers, size_t(count)});
    return true;
  }
  bool intermediate_callback(Ipopt::AlgorithmMode, Index iteration, Number cost, Number defect,
                             Number stationarity, Number, Number, Number regularisation, Number,
                             Number step, Index, const Ipopt::IpoptData*,
                             Ipopt::IpoptCalculatedQuantities*) override {
    iterations_ = iteration;
    history_.push_back({cost, defect, stationarity, step, regularisation});
    return !(o_.stop && o_.stop->load(std::memory_order_relaxed));
  }
  void finalize_solution(Ipopt::SolverReturn, Index n, const Number* z, const Number* lower,
                         const Number* upper, Index m, const Number*, const Number* lambda, Number,
                         const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {
    const size_t size = size_t(n);
    end({z, size}, {lambda, size_t(m)}, {lower, size}, {upper, size});
  }
  /// Where IPOPT broke off without an answer: its last iterate. @return whether there was one
  bool end_at_last_iterate() {
    if (accepted_.empty()) return false;
    const std::vector<double> none(accepted_.size(), 0.0),
        none_of_rows(programme_.rows().lower.size(), 0.0);
    end(accepted_, none_of_rows, none, none);
    return !plan.motion.x.empty();
  }

 private:
  using In = std::span<const double>;
  void end(In z, In multipliers, In lower, In upper) {
    if (!programme_.go_to(z)) return;  // IPOPT forgets its memory where an exception passes through
    plan = programme_.plan(z, multipliers, lower, upper);
    plan.iterations = iterations_;
    plan.evaluations = evaluations_;
    plan.history = std::move(history_);
  }
  bool go_to(Index n, const Number* z) {
    const std::span<const double> there(z, size_t(n));
    if (!std::equal(there.begin(), there.end(), last_.begin(), last_.end())) {
      last_.assign(there.begin(), there.end());
      ++evaluations_;
    }
    return programme_.go_to(there);
  }
  static bool copy(const NonlinearProgramme::Pattern& p, Index* row, Index* column) {
    std::copy(p.row.begin(), p.row.end(), row);
    std::copy(p.column.begin(), p.column.end(), column);
    return true;
  }

  NonlinearProgramme programme_;
  const PlannerOptions& o_;
  std::vector<double> z_, last_, accepted_;
  std::vector<Plan::Line> history_;
  int iterations_ = 0, evaluations_ = 0;
};

void set_options(Ipopt::OptionsList& list, const PlannerOptions& o, const IpoptOptions& own) {
  const bool exact = own.hessian == IpoptOptions::Hessian::exact;
  list.SetIntegerValue("print_level", 0);
  list.SetStringValue("sb", "yes");  // no banner
  list.SetNumericValue("tol", o.tolerance);
  list.SetNumericValue("mu_init", o.first_barrier);
  list.SetIntegerValue("max_iter", o.iterations);
  list.SetIntegerValue("acceptable_iter", 0);     // nothing less than the tolerance
  list.SetNumericValue("bound_relax_factor", 0);  // limits are kept
  list.SetStringValue("hessian_approximation", exact ? "exact" : "limited-memory");
  if (!own.check_derivatives) return;
  list.SetStringValue("derivative_test", exact ? "second-order" : "first-order");
  list.SetNumericValue("point_perturbation_radius", 1e-2);  // at 10 steps have no solution
}

Plan::Status status_of(Ipopt::ApplicationReturnStatus s) {
  switch (s) {
    case Ipopt::Solve_Succeeded:
      return Plan::Status::optimal;
    case Ipopt::User_Requested_Stop:
      return Plan::Status::stopped;
    case Ipopt::Maximum_Iterations_Exceeded:
      return Plan::Status::too_many_iterations;
    default:
      return Plan::Status::no_progress;
  }
}

}  // namespace

Plan solve_by_ipopt(const Problem& problem, const Trajectory& guess, const PlannerOptions& options,
                    const IpoptOptions& own) {
  check_guess(problem, guess);
  const SmartPtr<Ipopt::IpoptApplication> ipopt = new Ipopt::IpoptApplication(false);
  set_options(*ipopt->Options(), options, own);
  if (!own.log.empty() && !ipopt->OpenOutputFile(own.log, Ipopt::J_ITERSUMMARY))
    throw IoError("cannot write '" + own.log + "': " + std::strerror(errno));
  ipopt->Initialize("");  // no file of options
  const SmartPtr<Questions> questions = new Questions(problem, guess, options);
  const auto ended = ipopt->OptimizeTNLP(questions);
  Plan& plan = questions->plan;
  if (plan.motion.x.empty() && !questions->end_at_last_iterate())
    throw InvalidArgument("IPOPT cannot begin, expected a guess whose steps have a solution");
  plan.status = status_of(ended);
  return std::move(plan);
}

void add_ipopt() {
  add_solver("ipopt", [](const Problem& problem, const Trajectory& guess, const PlannerOptions& o) {
    return solve_by_ipopt(problem, guess, o);
  });
}

}  // namespace porthos::adapters
