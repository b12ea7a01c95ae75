#include "integrators/derivatives/step_pieces.h"

#include <algorithm>

#include "integrators/methods/composition.h"

namespace porthos::integrators {
namespace {

[[noreturn]] void refuse(const std::string& what, const std::string& method) {
  throw InvalidArgument("derivatives of a run are there for " + what + ", not for '" + method +
                        "'");
}

}  // namespace

StepPieces::StepPieces(const std::string& method, const phs::Model& model, double h)
    : n_(size_t(model.description().nx)) {
  method_ = make_integrator(method, model, h, {.port_work = false});
  auto* composed = dynamic_cast<ComposedSteps<double>*>(method_.get());
  staged_ = dynamic_cast<const StagedSteps<double>*>(composed ? &composed->base() : method_.get());
  if (!staged_)
    refuse(
        "Gauss collocation, Lobatto pairs, HBVM, discrete gradients, splittings, stormer_verlet, "
        "rk4, radau15, semi_implicit_euler and compositions (yoshida4 ...)",
        method);
  table_ = staged_->table();
  if (composed) {
    watched_ = true;
    count_ = composed->count();
    composed->watch([this](size_t i, double t, double taken, const phs::State& after) {
      keep(i, t, taken, after);
    });
  }
  stages_ = size_t(table_.s) * n_;
  size_ = 2 + stages_ + multipliers();
  numbers_.resize(count_ * size_);
  for (const auto& b : model.description().blocks)
    if (b.kind == phs::BlockKind::angle) angles_.push_back(size_t(b.at));
}

Outcome StepPieces::step(phs::State& state, double h) {
  const double t = method_->time(state);
  turns_.assign(state.turns.begin(), state.turns.end());
  const Outcome o = h == 0 ? method_->step(state) : method_->step_by(state, h);
  if (o != Outcome::ok) return o;
  if (!watched_) keep(0, t, h == 0 ? method_->step_size() : h, state);
  if (turns_ != state.turns) turn_stages(state.turns);
  return o;
}

void StepPieces::keep(size_t i, double t, double h, const phs::State& after) {
  count_ = i + 1;
  if (numbers_.size() < count_ * size_) numbers_.resize(count_ * size_);
  const std::span<double> to = std::span(numbers_).subspan(i * size_, size_);
  to[0] = t;
  to[1] = h;
  staged_->stages(after, to.subspan(2));
}

/// From the turns of the state before the step to those after it.
void StepPieces::turn_stages(const std::vector<std::int64_t>& turns) {
  for (size_t a = 0; a < angles_.size(); ++a) {
    const double by = double(turns[a] - turns_[a]) * phs::two_pi_hi;
    if (by == 0) continue;
    for (size_t i = 0; i < count_; ++i)
      for (size_t j = 0; j < size_t(table_.s); ++j)
        numbers_[i * size_ + 2 + j * n_ + angles_[a]] -= by;
  }
}

int gauss_stages(const std::string& method) {
  const Declaration& d = declaration_of(method);
  if (d.family != "Gauss collocation")
    refuse("Gauss collocation (gauss2 to gauss16, midpoint)", method);
  return d.order / 2;
}

}  // namespace porthos::integrators
