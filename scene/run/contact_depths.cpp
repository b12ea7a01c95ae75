#include "scene/run/contact_depths.h"

#include <fmt/format.h>

#include <algorithm>

#include "scene/assemble/contacts.h"
#include "scene/run/run_report.h"

namespace porthos::scene {

ContactDepths::ContactDepths(const Assembly& assembly, const RecordLayout& layout)
    : layout_(layout) {
  const auto* const model = contacts_in(*assembly.model);
  if (!model || model->contacts().empty()) return;
  contacts_.emplace(*model);
  for (const contact::Contact& c : model->contacts()) worst_.push_back({c.name});
  state_ = phs::State(assembly.model->description(), std::vector<double>(layout.nx));
}

void ContactDepths::see(std::span<const double> record) {
  if (!any()) return;
  std::ranges::copy(record.subspan(layout_.x(), layout_.nx), state_.x.begin());
  turns_of(layout_, record, state_.turns);
  const auto touches = contacts_->at(state_);
  for (size_t k = 0; k < worst_.size(); ++k) {
    const contact::SoftTouch& now = touches[k];
    Worst& w = worst_[k];
    if (now.depth > w.depth) w = {w.name, now.depth, now.half_size, record[layout_.time()]};
  }
}

void ContactDepths::fill(RunReport& report) const {
  constexpr double deep = 0.25;
  for (const Worst& w : worst_)
    if (w.depth > deep * w.half_size)
      report.notes.push_back(fmt::format(
          "contact '{}' sank {:.3g} m deep at {:.6g} s, in a shape of half-size {:.3g} m: a larger "
          "stiffness or loss keeps it out",
          w.name, w.depth, w.time, w.half_size));
}

}  // namespace porthos::scene
