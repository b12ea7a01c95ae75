#include "phs/system/reactions.h"

#include "phs/system/state.h"

namespace porthos::phs {

Reactions::Reactions(const Model& model)
    : system_(model.instantiate<double>()),
      moving_(model.instantiate<Dual>()),
      rows_(system_->constraints()),
      moving_rows_(moving_->constraints()) {
  const Description& d = model.description();
  if (!rows_) throw InvalidArgument("system '" + d.name + "' has no constraints to react");
  field_.resize(size_t(d.nx));
  x_.resize(field_.size());
  e_.resize(field_.size());
  lambda_.resize(size_t(rows_->count()));
  g_.resize(lambda_.size());
  rate_.resize(lambda_.size());
  exerted_.resize(size_t(d.reaction_count()));
  holds_ = model.holds();
  angles_.resize(size_t(d.angle_count()));
  dual_angles_.resize(angles_.size());
}
Reactions::~Reactions() = default;

std::span<const double> Reactions::exerted() {
  rows_->shorten(lambda_);
  rows_->exerted(lambda_, exerted_);
  return exerted_;
}

void Reactions::hold(std::span<const double> values) {
  if (held_.empty() && !holds_.empty()) {
    for (const auto& hold : holds_)
      held_.push_back(std::make_shared<std::vector<double>>(hold->fresh));
    system_->use_held(std::vector<HeldPtr>(held_.begin(), held_.end()));
  }
  size_t n = 0;
  for (const auto& h : held_) n += h->size();
  require_size("values held by sampled controllers", values.size(), n);
  auto from = values.begin();
  for (const auto& h : held_) {
    std::copy_n(from, h->size(), h->begin());
    from += long(h->size());
  }
}

std::span<const double> Reactions::at(double t, std::span<const double> x,
                                      std::span<const std::int64_t> turns) {
  require_size("x", x.size(), field_.size());
  for (size_t i = 0; i < angles_.size(); ++i)
    angles_[i] = i < turns.size() ? double(turns[i]) * two_pi_hi : 0;
  if (!angles_.empty()) {
    system_->set_turn_angles(angles_);
    set_turn_angles(angles_);
  }
  system_->field(t, x, {}, field_);
  return along(t, x, field_);
}

void Reactions::set_turn_angles(std::span<const double> angles) {
  for (size_t i = 0; i < dual_angles_.size(); ++i) dual_angles_[i] = Dual(angles[i]);
  rows_->set_turn_angles(angles);
  moving_->set_turn_angles(dual_angles_);
  moving_rows_->set_turn_angles(dual_angles_);
}

std::span<const double> Reactions::along(double t, std::span<const double> x,
                                         std::span<const double> rate, double stabilisation) {
  for (size_t i = 0; i < x_.size(); ++i) x_[i] = {x[i], rate[i]};
  moving_rows_->set_time({t, 1});
  moving_rows_->place(x_, rate_);
  moving_->gradient(x_, e_);
  moving_rows_->rates(e_, rate_);
  moving_rows_->add_drift(rate_);
  rows_->set_time(t);
  rows_->place(x, g_);
  for (size_t r = 0; r < lambda_.size(); ++r) {
    lambda_[r] = rate_[r].d;
    if (stabilisation != 0) lambda_[r] += stabilisation * (2 * rate_[r].v + stabilisation * g_[r]);
  }
  rows_->factor(x);
  rows_->solve(lambda_);
  return lambda_;
}

}  // namespace porthos::phs
