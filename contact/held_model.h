#pragma once
#include <memory>
#include <string_view>
#include <vector>

#include "contact/contact.h"

namespace porthos::contact {

/// What models for one run in which something holds have in common: the model of the whole, and a
/// Flag for everything that may hold. The whole and its contacts must outlive it.
template <class Derived, class Flag>
class HeldModel : public phs::ModelFor<Derived> {
 public:
  /// That of the whole, but its counts of jumps have other names: methods refuse a model that
  /// jumps, and this one does not.
  const phs::Description& description() const final { return description_; }
  std::vector<phs::HoldPtr> holds() const final { return whole_.holds(); }

  const phs::Model& whole() const { return whole_; }
  const ContactModel& contacts() const { return contacts_; }
  /// One for everything that may hold, as the run has it now.
  std::vector<Flag>& held() const { return *held_; }

 protected:
  /// @param whole  a model whose state begins with that of the mechanism in `contacts`
  /// @param counted  ending of the powers that count its jumps
  HeldModel(const phs::Model& whole, const ContactModel& contacts, std::size_t may_hold,
            std::string_view counted)
      : whole_(whole),
        contacts_(contacts),
        description_(whole.description()),
        held_(std::make_shared<std::vector<Flag>>(may_hold, Flag{})) {
    for (auto& p : description_.powers)
      if (p.kind == phs::PowerKind::observed && p.name.ends_with(counted)) p.name += "_so_far";
  }

 private:
  const phs::Model& whole_;
  const ContactModel& contacts_;
  phs::Description description_;
  std::shared_ptr<std::vector<Flag>> held_;
};

}  // namespace porthos::contact
