#include "scene/identification/detail/output_error.h"

#include <cmath>

namespace porthos::scene {
namespace {

double turned_back(double angle) { return std::remainder(angle, 2 * M_PI); }

}  // namespace

OutputError::OutputError(const Scene& scene, const Unknowns& unknowns, const Log& log,
                         const std::atomic<bool>* stop)
    : scene_(scene), unknowns_(unknowns), log_(log), stop_(stop), rows_(log.times.size()) {
  for (const auto& c : log.columns) names_.push_back(c.of.name);
  up_values_.resize(names_.size());
  down_values_.resize(names_.size());
}

Eigen::Index OutputError::size() const { return Eigen::Index(rows_ * log_.columns.size()); }

OutputError::VariantPtr OutputError::variant(const std::vector<double>& z) const {
  return std::make_unique<Variant>(unknowns_.at(z), names_);
}
OutputError::VariantPtr OutputError::moved(std::vector<double> z, size_t k, double by) const {
  z[k] += by;
  return variant(z);
}

bool OutputError::at(const std::vector<double>& z, Eigen::VectorXd& r, Eigen::MatrixXd* slopes) {
  using integrators::Along;
  up_.clear();
  down_.clear();
  std::vector<Along> directions;
  VariantPtr here;
  try {
    here = variant(z);
    const auto& d = here->assembly.model->description();
    const auto start = [&](const Variant& v) { return phs::with_turns(d, v.assembly.initial); };
    for (size_t k = 0; slopes && k < z.size(); ++k) {
      up_.push_back(moved(z, k, apart));
      down_.push_back(moved(z, k, -apart));
      const auto up = start(*up_[k]), down = start(*down_[k]);
      std::vector<double> tangent(up.size());
      for (size_t i = 0; i < up.size(); ++i) tangent[i] = (up[i] - down[i]) / (2 * apart);
      directions.push_back({std::move(tangent), up_[k]->assembly.model.get(),
                            down_[k]->assembly.model.get(), apart});
    }
  } catch (const InvalidArgument& e) {
    why_ = e.what();
    return false;
  }
  ++runs_;
  if (slopes) ++runs_with_tangents_;
  r.resize(size());
  if (slopes) slopes->resize(size(), Eigen::Index(z.size()));
  integrators::RunTangents run(scene_.method, *here->assembly.model, here->assembly.initial,
                               scene_.step, std::move(directions));
  double begin = 0;
  bool begun = false;
  for (size_t row = 0; row < rows_; ++row) {
    const double t = log_.times[row], rounding = 1e-9 * scene_.step;
    while (!begun || t > run.time() + rounding) {
      begin = run.time();
      begun = true;
      if (stopped() || run.step() != integrators::Outcome::ok) {
        why_ = stopped() ? "the command was stopped" : run.remark();
        return false;
      }
    }
    const double theta = std::min(1.0, (t - begin) / scene_.step);
    take_row(row, theta, t, run, *here, r, slopes);
  }
  return true;
}

void OutputError::take_row(size_t row, double theta, double t, const integrators::RunTangents& run,
                           Variant& here, Eigen::VectorXd& r, Eigen::MatrixXd* slopes) {
  phs::State s = run.state();
  run.interpolate(theta, s.x);
  std::ranges::fill(s.lo, 0.0);
  here.observation.at(t, s, up_values_);
  const size_t n = names_.size();
  for (size_t i = 0; i < n; ++i) {
    const LogColumn& c = log_.columns[i];
    const double off = up_values_[i] - c.values[row];
    r[Eigen::Index(row * n + i)] =
        (c.of.wraps ? turned_back(off) : off) / (c.sigma > 0 ? c.sigma : 1);
  }
  for (size_t k = 0; slopes && k < up_.size(); ++k)
    slope_row(row, k, theta, t, s, run, here, *slopes);
}

/// The slope of the observed numbers: along the tangent of the state, and by z at a fixed state.
void OutputError::slope_row(size_t row, size_t k, double theta, double t, const phs::State& s,
                            const integrators::RunTangents& run, Variant& here,
                            Eigen::MatrixXd& slopes) {
  const size_t n = names_.size();
  const auto add = [&](double distance, bool first) {
    for (size_t i = 0; i < n; ++i) {
      const LogColumn& c = log_.columns[i];
      const double off = up_values_[i] - down_values_[i];
      const double slope =
          (c.of.wraps ? turned_back(off) : off) / (2 * distance) / (c.sigma > 0 ? c.sigma : 1);
      double& to = slopes(Eigen::Index(row * n + i), Eigen::Index(k));
      to = first ? slope : to + slope;
    }
  };
  up_[k]->observation.at(t, s, up_values_);
  down_[k]->observation.at(t, s, down_values_);
  add(apart, true);
  tangent_.resize(s.x.size());
  run.interpolate(k, theta, tangent_);
  const double length = length_of(size_t(here.assembly.mechanism->nq()), s.x, tangent_);
  if (length == 0) return;
  const double distance = apart / length;
  phs::State moved = s;
  for (size_t i = 0; i < s.x.size(); ++i) moved.x[i] = s.x[i] + distance * tangent_[i];
  here.observation.at(t, moved, up_values_);
  for (size_t i = 0; i < s.x.size(); ++i) moved.x[i] = s.x[i] - distance * tangent_[i];
  here.observation.at(t, moved, down_values_);
  add(distance, false);
}

/// The length of a change of the state, in rad and m of places and against the largest momentum.
double OutputError::length_of(size_t nq, const std::vector<double>& x,
                              const std::vector<double>& dx) {
  double places = 0, largest = 0, momenta = 0;
  for (size_t i = 0; i < nq; ++i)
    places = std::max(places, std::fabs(dx[i]) / std::max(1.0, std::fabs(x[i])));
  for (size_t i = nq; i < x.size(); ++i) {
    largest = std::max(largest, std::fabs(x[i]));
    momenta = std::max(momenta, std::fabs(dx[i]));
  }
  return std::max(places, largest > 0 ? momenta / largest : momenta > 0 ? 1.0 : 0.0);
}

}  // namespace porthos::scene
